#include "tools/mix_options.h"

namespace clamor {

namespace {

constexpr int kMostRays = 1'000'000'000;  // all that it takes, in any level

}  // namespace

MixWords::MixWords(Arguments& parser) {
  parser.option("--interpolation", interpolation_,
                "cubic, or linear, which mixes a quarter more voices and has 1 dB less at 8 kHz "
                "[cubic]");
  parser.option("--visibility", visibility_, "on or off: do surfaces hide sources [on]");
  parser.option("--rays", rays_, {1, kMostRays},
                "a keyframe (50 a second), to look for what they hide");
}

Result<void> MixWords::read(AuralizerOptions& options) const {
  if (visibility_ != "on" && visibility_ != "off")
    return Error("--visibility is on or off, not " + in_quotes(visibility_));
  if (interpolation_ != "cubic" && interpolation_ != "linear")
    return Error("--interpolation is cubic or linear, not " + in_quotes(interpolation_));
  options.visibility = visibility_ == "on";
  options.interpolation =
      interpolation_ == "linear" ? Interpolation::kLinear : Interpolation::kCubic;
  options.rays = rays_;
  return {};
}

}  // namespace clamor
