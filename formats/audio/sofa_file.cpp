#include "formats/audio/sofa_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <mysofa.h>

#include "formats/files/child_process.h"

namespace clamor {

namespace {

constexpr unsigned kFewestDirections = 16, kMaxDirections = 20000, kMaxFrames = 16384;
constexpr double kMinHrirRate_hz = 8000, kMaxHrirRate_hz = 384000, kMaxLag_s = 0.1;
constexpr std::uintmax_t kMaxInput_bytes = 1 << 30;

constexpr std::uint64_t kMinMemory_bytes = 1'000'000'000;  // memory limit of the reading process
constexpr unsigned kMinTime_s = 2;                         // KEMAR takes 0.03 s
constexpr std::uintmax_t kSlowest_bytes_per_s = 5'000'000;
constexpr unsigned kWallPerCpu = 10;  // allows for slow disks and busy machines

struct FreeHead {
  void operator()(MYSOFA_HRTF* head) const { mysofa_free(head); }
};

// Unvalidated output of libmysofa.
struct Tables {
  struct Shape {
    std::int32_t problem = 0;  // error code of libmysofa
    std::int32_t is_head = 0;
    std::uint32_t directions = 0, ears = 0, coordinates = 0, frames = 0;
    std::array<char, 40> convention{};
  } shape;
  std::vector<float> rate, delay, position, samples;
};

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
  void put(const MYSOFA_ARRAY& array) {
    const std::uint64_t count = array.values == nullptr ? 0 : array.elements;
    put(&count, sizeof count);
    put(array.values, count * sizeof(float));
  }
  bool get(std::vector<float>& values) {
    std::uint64_t count = 0;
    if (!get(&count, sizeof count) || count > (bytes_.size() - at_) / sizeof(float)) return false;
    values.resize(count);
    return get(values.data(), count * sizeof(float));
  }

 private:
  std::vector<std::byte> bytes_;
  std::size_t at_ = 0;
};

std::vector<std::byte> tables_of(const std::string& path) {
  Tables::Shape shape;
  int problem = 0;
  const std::unique_ptr<MYSOFA_HRTF, FreeHead> head(mysofa_load(path.c_str(), &problem));
  Bytes bytes;
  shape.problem = head == nullptr && problem == 0 ? -1 : problem;
  if (head == nullptr) {
    bytes.put(&shape, sizeof shape);
    return bytes.take();
  }
  shape.is_head = mysofa_check(head.get()) == MYSOFA_OK;
  shape.directions = head->M;
  shape.ears = head->R;
  shape.coordinates = head->C;
  shape.frames = head->N;
  char name[] = "SOFAConventions";
  if (const char* of = mysofa_getAttribute(head->attributes, name); of != nullptr)
    std::strncpy(shape.convention.data(), of, shape.convention.size() - 1);
  if (shape.is_head != 0) mysofa_tocartesian(head.get());
  bytes.put(&shape, sizeof shape);
  for (const MYSOFA_ARRAY* array :
       {&head->DataSamplingRate, &head->DataDelay, &head->SourcePosition, &head->DataIR})
    bytes.put(*array);
  return bytes.take();
}

// Runs libmysofa in a child process. Of 18 000 randomly damaged files none crashed libmysofa 1.3.1,
// but one kept it in an endless loop, and crafted files crash it (github.com/hoene/libmysofa, issue
// 231).
Result<Tables> read_tables(const std::string& path, std::uintmax_t file_bytes) {
  ChildLimits limits;
  limits.memory_bytes = kMinMemory_bytes + 8 * file_bytes;
  limits.cpu_s = kMinTime_s + static_cast<unsigned>(file_bytes / kSlowest_bytes_per_s);
  limits.wall_s = kWallPerCpu * limits.cpu_s;
  auto read = in_child_process(limits, [&] { return tables_of(path); });
  if (!read.ok()) return read.error();
  Bytes bytes(std::move(*read));
  Tables tables;
  if (!bytes.get(&tables.shape, sizeof tables.shape))
    return Error("crashes the library that reads it");
  if (tables.shape.problem == 0 && !(bytes.get(tables.rate) && bytes.get(tables.delay) &&
                                     bytes.get(tables.position) && bytes.get(tables.samples)))
    return Error("crashes the library that reads it");
  tables.shape.convention.back() = 0;
  return tables;
}

// Checks the convention, the sizes and the rate of the tables.
Result<void> check_tables(const Tables& tables) {
  const Tables::Shape& shape = tables.shape;
  if (shape.problem != 0)
    return Error(fmt::format(
        "is no SOFA file that can be read (error {} of libmysofa); give one of the convention "
        "SimpleFreeFieldHRIR.",
        shape.problem));
  if (shape.is_head == 0 || shape.ears != 2 || shape.coordinates != 3) {
    const std::string convention = shape.convention.data();
    return Error(
        convention.empty() || convention == "SimpleFreeFieldHRIR"
            ? "holds no responses of two ears, as SimpleFreeFieldHRIR has them; export "
              "it again."
            : fmt::format("is of the convention {}; give one of SimpleFreeFieldHRIR.", convention));
  }
  if (shape.directions < kFewestDirections || shape.directions > kMaxDirections ||
      shape.frames == 0 || shape.frames > kMaxFrames)
    return Error(fmt::format("holds {} directions of {} frames; {} to {} of at most {} are read.",
                             shape.directions, shape.frames, kFewestDirections, kMaxDirections,
                             kMaxFrames));
  const std::size_t directions = shape.directions;
  const std::vector<float>&rate = tables.rate, &delay = tables.delay;
  if (rate.size() != 1 || tables.position.size() != 3 * directions ||
      tables.samples.size() != 2 * directions * shape.frames ||
      (delay.size() != 2 && delay.size() != 2 * directions))
    return Error("has tables that do not fit together; export it again.");
  if (!(rate[0] >= kMinHrirRate_hz && rate[0] <= kMaxHrirRate_hz))
    return Error(fmt::format("has a sampling rate of {} Hz; {} to {} are read.", rate[0],
                             kMinHrirRate_hz, kMaxHrirRate_hz));
  return {};
}

// Delays of all responses in frames, [direction][left, right].
Result<std::vector<int>> response_delays(const Tables& tables) {
  std::vector<int> delays;
  for (std::size_t i = 0; i < std::size_t{2} * tables.shape.directions; ++i) {
    const double frames_late =
        static_cast<double>(tables.delay[tables.delay.size() == 2 ? i % 2 : i]);
    if (!(frames_late >= 0 && frames_late <= kMaxLag_s * static_cast<double>(tables.rate[0])))
      return Error("has a delay that is negative or beyond 0.1 s; export it again.");
    delays.push_back(static_cast<int>(std::lround(frames_late)));
  }
  return delays;
}

Result<HrirSet> responses_of(const Tables& tables) {
  const auto delays = response_delays(tables);
  if (!delays.ok()) return delays.error();
  const std::size_t directions = tables.shape.directions, frames = tables.shape.frames;
  HrirSet responses;
  responses.rate_hz = static_cast<double>(tables.rate[0]);
  const int longest = *std::ranges::max_element(*delays);
  responses.frames = frames + static_cast<std::size_t>(longest);
  responses.samples.resize(2 * directions * responses.frames);
  for (std::size_t d = 0; d < directions; ++d) {
    const float* at = tables.position.data() + 3 * d;
    const Vec3 to(static_cast<double>(at[0]), static_cast<double>(at[1]),
                  static_cast<double>(at[2]));
    if (!is_finite(to) || !(length(to) > 1e-6))
      return Error("has a source without a direction; export it again.");
    responses.directions.push_back(Vec3f(normalize(to)));
    for (std::size_t ear = 0; ear < 2; ++ear) {
      const std::size_t row = 2 * d + ear;
      const float* from = tables.samples.data() + row * frames;
      if (!std::all_of(from, from + frames, [](float x) { return std::abs(x) < 1e6f; }))
        return Error("holds samples that are no finite numbers; repair it.");
      std::copy_n(from, frames,
                  responses.samples.begin() + static_cast<std::ptrdiff_t>(row * responses.frames) +
                      (*delays)[row]);
    }
  }
  return responses;
}

}  // namespace

Result<HrirSet> read_sofa(const std::string& path) {
  const auto refused = [&](const std::string& why) { return Error(path + ": " + why); };
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) return refused("cannot be read (" + error.message() + ").");
  if (bytes > kMaxInput_bytes) return refused("is larger than 1 GiB, which no head should be.");
  const auto tables = read_tables(path, bytes);
  if (!tables.ok()) return refused(tables.error().message + "; it is damaged, or no SOFA file.");
  if (const auto good = check_tables(*tables); !good.ok()) return refused(good.error().message);
  auto responses = responses_of(*tables);
  if (!responses.ok()) return refused(responses.error().message);
  return responses;
}

}  // namespace clamor
