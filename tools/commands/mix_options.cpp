#include "tools/commands/mix_options.h"

#include <memory>
#include <utility>

#include "formats/level/emitter_spec.h"

namespace clamor {

namespace {

constexpr int kMostRays = 1'000'000'000;  // all that it takes, in any level

}  // namespace

MixArguments::MixArguments(Arguments& parser) {
  parser.option("--interpolation", interpolation_,
                "cubic, or linear, which mixes a quarter more voices and has 1 dB less at 8 kHz "
                "[cubic]");
  parser.option("--visibility", visibility_, "on or off: do surfaces hide sources [on]");
  parser.option(
      "--rays", rays_, {1, kMostRays},
      "a keyframe (50 a second), to look for what they hide; a render casts as many as it "
      "takes");
  parser.option("--memory", memory_,
                "as in 64MB, of the bake's pages and sounds to keep in memory, whatever the file's "
                "size [64MB]");
  parser.flag("--no-mmap", no_mmap_,
              "read the bake's parts into memory instead of mapping the file");
  parser.option("--gain", gain_,
                "of the whole output: decibels, as in -6dB, or a factor, as in x0.5");
  parser.option("--moving", script_, "sources that come, move and go as SCRIPT.json says");
}

Result<void> MixArguments::read(AuralizerOptions& options) const {
  if (visibility_ != "on" && visibility_ != "off")
    return Error("--visibility is on or off, not " + in_quotes(visibility_));
  if (interpolation_ != "cubic" && interpolation_ != "linear")
    return Error("--interpolation is cubic or linear, not " + in_quotes(interpolation_));
  options.visibility = visibility_ == "on";
  options.interpolation =
      interpolation_ == "linear" ? Interpolation::kLinear : Interpolation::kCubic;
  options.rays = rays_;
  if (memory_) {
    const auto bytes = parse_bytes(*memory_);
    if (!bytes.ok()) return Error("--memory " + bytes.error().message);
    options.memory_bytes = *bytes;
  }
  constexpr double kGreatestOutputGain = 1e10;  // 200 dB
  const auto amplitude = parse_gain(gain_, kGreatestOutputGain);
  if (!amplitude.ok()) return amplitude.error();
  options.gain = *amplitude;
  return {};
}

Result<void> MixArguments::read_script(AuralizerOptions& options, std::size_t baked_signals,
                                       InputFiles& inputs) const {
  if (script_.empty()) return {};
  auto script = MovingScript::read(script_);
  if (!script.ok()) return script.error();
  inputs.add(script->files());
  options.moving = script->options(baked_signals);
  options.script = std::make_shared<MovingScript>(std::move(*script));
  return {};
}

}  // namespace clamor
