#include "formats/sofa_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <mysofa.h>

namespace clamor {

namespace {

constexpr const char* kDefaultHead = "/usr/share/libmysofa/default.sofa";
constexpr unsigned kFewestDirections = 16, kMostDirections = 20000, kMostFrames = 16384;
constexpr double kLeastRate_hz = 8000, kMostRate_hz = 384000, kMostLag_s = 0.1;
constexpr std::uintmax_t kMostFile_bytes = 1 << 30;

struct FreeHead {
  void operator()(MYSOFA_HRTF* head) const { mysofa_free(head); }
};

}  // namespace

Result<HeadResponses> read_sofa(const std::string& path) {
  const std::string& name = path.empty() ? std::string(kDefaultHead) : path;
  const auto refused = [&](const std::string& why) { return Error(name + ": " + why); };
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(name, error);
  if (error)
    return refused(path.empty() ? "the head that binaural output needs is not there; install "
                                  "libmysofa1 or name a SOFA file with --hrtf."
                                : "cannot be read (" + error.message() + ").");
  if (bytes > kMostFile_bytes) return refused("is larger than 1 GiB, which no head should be.");
  int problem = 0;
  const std::unique_ptr<MYSOFA_HRTF, FreeHead> head(mysofa_load(name.c_str(), &problem));
  if (head == nullptr)
    return refused(fmt::format(
        "is no SOFA file that can be read (error {} of libmysofa); give one of the convention "
        "SimpleFreeFieldHRIR.",
        problem));
  if (mysofa_check(head.get()) != MYSOFA_OK || head->R != 2 || head->C != 3)
    return refused("holds no responses of two ears; give one of SimpleFreeFieldHRIR.");
  if (head->M < kFewestDirections || head->M > kMostDirections || head->N == 0 ||
      head->N > kMostFrames)
    return refused(fmt::format("holds {} directions of {} frames; {} to {} of at most {} are read.",
                               head->M, head->N, kFewestDirections, kMostDirections, kMostFrames));
  const std::size_t directions = head->M, frames = head->N;
  const MYSOFA_ARRAY &rate = head->DataSamplingRate, &delay = head->DataDelay;
  if (rate.elements < 1 || !(rate.values[0] >= kLeastRate_hz && rate.values[0] <= kMostRate_hz) ||
      head->SourcePosition.elements != 3 * directions ||
      head->DataIR.elements != 2 * directions * frames ||
      (delay.elements != 2 && delay.elements != 2 * directions))
    return refused("has tables that do not fit together; export it again.");
  mysofa_tocartesian(head.get());

  HeadResponses responses;
  responses.rate_hz = static_cast<double>(rate.values[0]);
  std::vector<int> delays;
  for (std::size_t i = 0; i < 2 * directions; ++i) {
    const double frames_late = static_cast<double>(delay.values[delay.elements == 2 ? i % 2 : i]);
    if (!(frames_late >= 0 && frames_late <= kMostLag_s * responses.rate_hz))
      return refused("has a delay that is negative or beyond 0.1 s; export it again.");
    delays.push_back(static_cast<int>(std::lround(frames_late)));
  }
  const int longest = *std::ranges::max_element(delays);
  responses.frames = frames + static_cast<std::size_t>(longest);
  responses.samples.resize(2 * directions * responses.frames);
  for (std::size_t d = 0; d < directions; ++d) {
    const float* at = head->SourcePosition.values + 3 * d;
    const Vec3 to(static_cast<double>(at[0]), static_cast<double>(at[1]),
                  static_cast<double>(at[2]));
    if (!is_finite(to) || !(length(to) > 1e-6))
      return refused("has a source without a direction; export it again.");
    responses.directions.push_back(Vec3f(normalize(to)));
    for (std::size_t ear = 0; ear < 2; ++ear) {
      const std::size_t row = 2 * d + ear;
      const float* from = head->DataIR.values + row * frames;
      if (!std::all_of(from, from + frames, [](float x) { return std::abs(x) < 1e6f; }))
        return refused("holds samples that are no finite numbers; repair it.");
      std::copy_n(from, frames,
                  responses.samples.begin() + static_cast<std::ptrdiff_t>(row * responses.frames) +
                      delays[row]);
    }
  }
  return responses;
}

}  // namespace clamor
