#include "formats/audio/sofa_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "common/utf8_path.h"
#include "formats/audio/hdf5_file.h"
#include "formats/audio/sofa_tables.h"
#include "formats/files/file_kind.h"

namespace clamor {

namespace {

constexpr unsigned kFewestDirections = 16, kMaxDirections = 20000, kMaxFrames = 16384;
constexpr double kMinHrirRate_hz = 8000, kMaxHrirRate_hz = 384000, kMaxLag_s = 0.1;
constexpr std::uintmax_t kMaxInput_bytes = 1 << 30;
constexpr const char *kConvention = "SimpleFreeFieldHRIR", *kNotRead = "is not read by libhdf5";

// Checks the convention, the sizes and the rate of the tables.
Result<void> check_tables(const SofaTables& tables) {
  const SofaTables::Shape& shape = tables.shape;
  if (shape.problem != 0)
    return Error(fmt::format(
        "is no SOFA file that can be read (error {} of libmysofa); give one of the convention "
        "SimpleFreeFieldHRIR.",
        shape.problem));
  const std::string convention = shape.convention.data(), data_type = shape.data_type.data();
  const bool sections = data_type == "SOS" || convention.ends_with("SOS");
  if (sections || data_type.starts_with("TF") || convention.ends_with("HRTF"))
    return Error(fmt::format(
        "holds {} ({}), which are not read; give the same head as SimpleFreeFieldHRIR, which most "
        "databases offer beside it.",
        sections ? "filters as second-order sections" : "transfer functions over frequency",
        convention.empty() ? data_type : convention));
  if (!convention.empty() && convention != kConvention && convention != "GeneralFIR")
    return Error(
        fmt::format("is of the convention {}; give one of SimpleFreeFieldHRIR.", convention));
  if (shape.ears != 2 || shape.coordinates != 3 || tables.samples.empty())
    return Error(
        "holds no responses of two ears, as SimpleFreeFieldHRIR has them; export it again.");
  if (shape.directions < kFewestDirections || shape.directions > kMaxDirections ||
      shape.frames == 0 || shape.frames > kMaxFrames)
    return Error(fmt::format("holds {} directions of {} frames; {} to {} of at most {} are read.",
                             shape.directions, shape.frames, kFewestDirections, kMaxDirections,
                             kMaxFrames));
  const std::size_t directions = shape.directions;
  const std::vector<float>&rate = tables.rate, &delay = tables.delay;
  if (rate.empty() || std::ranges::any_of(rate, [&](float hz) { return hz != rate[0]; }) ||
      tables.sources.size() != 3 * directions ||
      tables.samples.size() != 2 * directions * shape.frames ||
      (delay.size() > 2 && delay.size() != 2 * directions))
    return Error("has tables that do not fit together; export it again.");
  if (!(rate[0] >= kMinHrirRate_hz && rate[0] <= kMaxHrirRate_hz))
    return Error(fmt::format("has a sampling rate of {} Hz; {} to {} are read.", rate[0],
                             kMinHrirRate_hz, kMaxHrirRate_hz));
  return {};
}

// Delays of all responses in frames, [direction][left, right].
Result<std::vector<int>> response_delays(const SofaTables& tables) {
  std::vector<int> delays;
  for (std::size_t i = 0; i < std::size_t{2} * tables.shape.directions; ++i) {
    const std::size_t known = tables.delay.size();  // for each ear or response, or one for all
    const double frames_late =
        known == 0 ? 0 : static_cast<double>(tables.delay[known <= 2 ? i % known : i]);
    if (!(frames_late >= 0 && frames_late <= kMaxLag_s * static_cast<double>(tables.rate[0])))
      return Error("has a delay that is negative or beyond 0.1 s; export it again.");
    delays.push_back(static_cast<int>(std::lround(frames_late)));
  }
  return delays;
}

Vec3 row_of(const std::vector<float>& rows, std::size_t index) {
  const float* at = rows.data() + 3 * (rows.size() == 3 ? 0 : index);
  return {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
}

// Whether a table has a row for all directions or one for each.
bool has_rows(const std::vector<float>& rows, std::size_t directions) {
  return rows.size() == 3 || rows.size() == 3 * directions;
}

// The direction of a source as the head has it: relative to where the listener is and looks.
Vec3 direction_from_head(const SofaTables& tables, std::size_t index) {
  const std::size_t count = tables.shape.directions;
  Vec3 to = row_of(tables.sources, index);
  if (has_rows(tables.listeners, count)) to -= row_of(tables.listeners, index);
  if (!has_rows(tables.views, count)) return to;
  const Vec3 view = row_of(tables.views, index);
  const Vec3 up = has_rows(tables.ups, count) ? row_of(tables.ups, index) : Vec3(0, 0, 1);
  const Vec3 left = cross(up, view);
  if (!(length(view) > 1e-6) || !(length(left) > 1e-6)) return to;
  const Vec3 x = normalize(view), y = normalize(left);
  return {dot(to, x), dot(to, y), dot(to, cross(x, y))};
}

Result<HrirSet> responses_of(const SofaTables& tables) {
  const auto delays = response_delays(tables);
  if (!delays.ok()) return delays.error();
  const std::size_t directions = tables.shape.directions, frames = tables.shape.frames;
  HrirSet responses;
  responses.rate_hz = static_cast<double>(tables.rate[0]);
  const bool right_first =
      tables.receivers.size() == 6 && tables.receivers[1] < tables.receivers[4];
  const int longest = *std::ranges::max_element(*delays);
  responses.frames = frames + static_cast<std::size_t>(longest);
  responses.samples.resize(2 * directions * responses.frames);
  for (std::size_t d = 0; d < directions; ++d) {
    const Vec3 to = direction_from_head(tables, d);
    if (!is_finite(to) || !(length(to) > 1e-6))
      return Error("has a source without a direction; export it again.");
    responses.directions.push_back(Vec3f(normalize(to)));
    for (std::size_t ear = 0; ear < 2; ++ear) {
      const std::size_t row = 2 * d + (right_first ? 1 - ear : ear);
      const float* from = tables.samples.data() + row * frames;
      if (!std::all_of(from, from + frames, [](float x) { return std::abs(x) < 1e6f; }))
        return Error("holds samples that are no finite numbers; repair it.");
      std::copy_n(from, frames,
                  responses.samples.begin() +
                      static_cast<std::ptrdiff_t>((2 * d + ear) * responses.frames) +
                      (*delays)[row]);
    }
  }
  return responses;
}

// The Error is a sentence without the file's name; kNotRead if libhdf5 does not read it.
Result<HrirSet> read_by(SofaLibrary library, const std::string& path, std::uint64_t bytes) {
  const auto tables = read_sofa_tables(path, bytes, library);
  if (!tables.ok()) return Error(tables.error().message + "; it is damaged, or no SOFA file.");
  if (library == SofaLibrary::kHdf5 && tables->shape.problem != 0) return Error(kNotRead);
  if (const auto good = check_tables(*tables); !good.ok()) return good.error();
  return responses_of(*tables);
}

}  // namespace

Result<HrirSet> read_sofa(const std::string& path) {
  const auto refused = [&](const std::string& why) { return Error(path + ": " + why); };
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path_of(path), error);
  if (error) return refused("cannot be read (" + error.message() + ").");
  if (bytes > kMaxInput_bytes) return refused("is larger than 1 GiB, which no head should be.");
  std::array<char, 4096> head{};
  std::ifstream file(path_of(path), std::ios::binary);
  file.read(head.data(), head.size());
  const std::size_t head_bytes =
      static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0));
  const std::string other =
      other_kind(std::as_bytes(std::span(head.data(), head_bytes)), FileKind::kHead);
  if (!other.empty()) return refused(other + ".");
  Result<HrirSet> responses = Error("is damaged, or no SOFA file.");
  if (has_mysofa()) responses = read_by(SofaLibrary::kMysofa, path, bytes);
  if (responses.ok()) return responses;
  const bool has_hdf5 = load_hdf5();
  if (!has_mysofa() && !has_hdf5)
    return refused("is read by libhdf5, which is missing; install it (Debian: hdf5-tools).");
  if (has_hdf5) {
    auto again = read_by(SofaLibrary::kHdf5, path, bytes);
    if (again.ok() || again.error().message != kNotRead) responses = std::move(again);
  }
  if (responses.ok()) return responses;
  return refused(responses.error().message +
                 (has_hdf5 ? ""
                           : " If another program reads it, install libhdf5 (Debian: hdf5-tools), "
                             "which Clamor uses where libmysofa fails: on 32-bit floats, integers, "
                             "deflate without shuffle and files of h5py and h5repack."));
}

}  // namespace clamor
