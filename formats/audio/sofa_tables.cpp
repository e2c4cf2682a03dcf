#include "formats/audio/sofa_tables.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

#ifdef CLAMOR_HAS_MYSOFA
#include <mysofa.h>
#endif

#include "common/maths.h"
#include "common/platform/child_process.h"
#include "formats/audio/hdf5_file.h"

namespace clamor {

namespace {

constexpr std::uint64_t kMinMemory_bytes = 1'000'000'000;  // memory limit of the reading process
constexpr unsigned kMinTime_s = 2;                         // KEMAR takes 0.03 s
constexpr std::uint64_t kSlowest_bytes_per_s = 5'000'000;
constexpr unsigned kWallPerCpu = 10;  // allows for slow disks and busy machines
constexpr std::uint64_t kMaxValues = std::uint64_t{1} << 28;

class Bytes {
 public:
  explicit Bytes(std::vector<std::byte> bytes = {}) : bytes_(std::move(bytes)) {}
  std::vector<std::byte>&& take() { return std::move(bytes_); }

  void put(const void* from, std::size_t count) {
    const auto* first = static_cast<const std::byte*>(from);
    bytes_.insert(bytes_.end(), first, first + count);
  }
  bool get(void* to, std::size_t count) {
    if (count > bytes_.size() - at_) return false;
    if (count > 0) std::memcpy(to, bytes_.data() + at_, count);
    at_ += count;
    return true;
  }
  void put(const std::vector<float>& values) {
    const std::uint64_t count = values.size();
    put(&count, sizeof count);
    put(values.data(), values.size() * sizeof(float));
  }
  bool get(std::vector<float>& values) {
    std::uint64_t count = 0;
    if (!get(&count, sizeof count) || count > (bytes_.size() - at_) / sizeof(float)) return false;
    values.resize(static_cast<std::size_t>(count));
    return get(values.data(), values.size() * sizeof(float));
  }

 private:
  std::vector<std::byte> bytes_;
  std::size_t at_ = 0;
};

constexpr std::array kTables = {
    &SofaTables::rate,      &SofaTables::delay,     &SofaTables::sources, &SofaTables::samples,
    &SofaTables::receivers, &SofaTables::listeners, &SofaTables::views,   &SofaTables::ups};

void set_text(std::array<char, 40>& to, const char* text) {
  if (text != nullptr) std::strncpy(to.data(), text, to.size() - 1);
}

// From azimuth and elevation in degrees and a distance.
void make_cartesian(std::vector<float>& positions) {
  constexpr double kRadians = 0.017453292519943295;
  for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
    const double azimuth = std::remainder(static_cast<double>(positions[i]), 360) * kRadians;
    const double elevation = std::remainder(static_cast<double>(positions[i + 1]), 360) * kRadians;
    const auto distance = static_cast<double>(positions[i + 2]);
    if (!std::isfinite(azimuth) || !std::isfinite(elevation)) continue;
    positions[i] = static_cast<float>(distance * cos_of(elevation) * cos_of(azimuth));
    positions[i + 1] = static_cast<float>(distance * cos_of(elevation) * sin_of(azimuth));
    positions[i + 2] = static_cast<float>(distance * sin_of(elevation));
  }
}

// Receivers and emitters may have a third dimension, [row][x, y, z][measurement]: keeps the first.
std::vector<float> first_measurement(std::vector<float> values, std::size_t rows) {
  const std::size_t repeats = rows == 0 ? 1 : values.size() / (3 * rows);
  if (repeats <= 1 || values.size() != 3 * rows * repeats) return values;
  std::vector<float> first(3 * rows);
  for (std::size_t i = 0; i < first.size(); ++i) first[i] = values[i * repeats];
  return first;
}

#ifdef CLAMOR_HAS_MYSOFA

struct FreeHead {
  void operator()(MYSOFA_HRTF* head) const { mysofa_free(head); }
};

SofaTables by_mysofa(const std::string& path) {
  SofaTables tables;
  int problem = 0;
  const std::unique_ptr<MYSOFA_HRTF, FreeHead> head(mysofa_load(path.c_str(), &problem));
  tables.shape.problem = head == nullptr && problem == 0 ? -1 : problem;
  if (head == nullptr) return tables;
  tables.shape = {.problem = problem,
                  .directions = head->M,
                  .ears = head->R,
                  .coordinates = head->C,
                  .frames = head->N};
  const auto text = [](MYSOFA_ATTRIBUTE* attributes, std::string name) {
    const char* value = mysofa_getAttribute(attributes, name.data());
    return value == nullptr ? "" : value;
  };
  set_text(tables.shape.convention, text(head->attributes, "SOFAConventions"));
  set_text(tables.shape.data_type, text(head->attributes, "DataType"));
  const auto values = [&](const MYSOFA_ARRAY& array) {
    std::vector<float> copy;
    if (array.values != nullptr) copy.assign(array.values, array.values + array.elements);
    if (std::string_view(text(array.attributes, "Type")) == "spherical") make_cartesian(copy);
    return copy;
  };
  tables.rate = values(head->DataSamplingRate);
  tables.delay = values(head->DataDelay);
  tables.sources = values(head->SourcePosition);
  tables.samples = values(head->DataIR);
  tables.receivers = first_measurement(values(head->ReceiverPosition), head->R);
  tables.listeners = values(head->ListenerPosition);
  tables.views = values(head->ListenerView);
  tables.ups = values(head->ListenerUp);
  return tables;
}

#else

SofaTables by_mysofa(const std::string&) { return {}; }

#endif

SofaTables by_hdf5(const std::string& path) {
  SofaTables tables;
  tables.shape.problem = -1;
  const auto file = Hdf5File::open(path);
  if (!file) return tables;
  tables.shape.problem = 0;
  set_text(tables.shape.convention, file->text("/", "SOFAConventions").c_str());
  set_text(tables.shape.data_type, file->text("/", "DataType").c_str());
  const auto values = [&](const char* name) {
    auto table = file->table(name, kMaxValues);
    if (!table) return std::vector<float>{};
    if (file->text(name, "Type") == "spherical") make_cartesian(table->values);
    return std::move(table->values);
  };
  if (auto responses = file->table("Data.IR", kMaxValues);
      responses && responses->sizes.size() == 3) {
    tables.shape.directions = static_cast<std::uint32_t>(responses->sizes[0]);
    tables.shape.ears = static_cast<std::uint32_t>(responses->sizes[1]);
    tables.shape.frames = static_cast<std::uint32_t>(responses->sizes[2]);
    tables.samples = std::move(responses->values);
  }
  tables.shape.coordinates = 3;
  tables.rate = values("Data.SamplingRate");
  tables.delay = values("Data.Delay");
  tables.sources = values("SourcePosition");
  tables.receivers = first_measurement(values("ReceiverPosition"), tables.shape.ears);
  tables.listeners = values("ListenerPosition");
  tables.views = values("ListenerView");
  tables.ups = values("ListenerUp");
  return tables;
}

}  // namespace

bool has_mysofa() {
#ifdef CLAMOR_HAS_MYSOFA
  return true;
#else
  return false;
#endif
}

Result<SofaTables> read_sofa_tables(const std::string& path, std::uint64_t file_bytes,
                                    SofaLibrary library) {
  ChildLimits limits;
  limits.memory_bytes = kMinMemory_bytes + 8 * file_bytes;
  limits.cpu_s = kMinTime_s + static_cast<unsigned>(file_bytes / kSlowest_bytes_per_s);
  limits.wall_s = kWallPerCpu * limits.cpu_s;
  auto read = in_child_process(limits, [&] {
    const SofaTables tables = library == SofaLibrary::kMysofa ? by_mysofa(path) : by_hdf5(path);
    Bytes bytes;
    bytes.put(&tables.shape, sizeof tables.shape);
    for (const auto table : kTables) bytes.put(tables.*table);
    return bytes.take();
  });
  if (!read.ok()) return read.error();
  Bytes bytes(std::move(*read));
  SofaTables tables;
  bool complete = bytes.get(&tables.shape, sizeof tables.shape);
  for (const auto table : kTables) complete = complete && bytes.get(tables.*table);
  if (!complete) return Error("crashes the library that reads it");
  tables.shape.convention.back() = tables.shape.data_type.back() = 0;
  return tables;
}

}  // namespace clamor
