#include "tools/commands/mix_options.h"

#include <memory>
#include <utility>

#include "formats/level/emitter_spec.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/sampling/moving_script.h"

namespace clamor {

namespace {

constexpr int kMaxRays = 1'000'000'000;  // more than any level needs

}  // namespace

MixArguments::MixArguments(Arguments& parser) {
  parser.option("--interpolation", interpolation_,
                "cubic or linear; linear mixes a quarter more voices and loses 1 dB at 8 kHz");
  parser.words("--interpolation", {"cubic", "linear"});
  parser.option("--visibility", visibility_, "on or off: occlusion of sources by surfaces");
  parser.words("--visibility", {"on", "off"});
  parser.option(
      "--rays", rays_, {1, kMaxRays},
      "maximum number of occlusion rays per keyframe (50 keyframes a second); a render casts as "
      "many as it needs");
  parser.option("--memory", memory_,
                "memory for the bake's pages and sounds, as in 64MB, of which sounds use up to "
                "half [64 MB for "
                "pages, and what all sounds take decoded, up to 256 MB]");
  parser.flag("--no-mmap", no_mmap_, "read the bake file instead of memory-mapping it");
  parser.option("--gain", gain_, "output gain: decibels, as in -6dB, or a factor, as in x0.5");
  parser.option("--limiter", limiter_,
                "on or off: limit true peaks to -1 dBFS, instead of letting them clip [unset: on, "
                "but off for a render of float samples]");
  parser.words("--limiter", {"on", "off"});
  parser.option("--moving", script_,
                "script of moving sources, movable parts (doors) and portals, SCRIPT.json");
}

Result<void> MixArguments::read(AuralizerOptions& options) const {
  if (visibility_ != "on" && visibility_ != "off")
    return Error("--visibility must be on or off, not " + in_quotes(visibility_));
  if (interpolation_ != "cubic" && interpolation_ != "linear")
    return Error("--interpolation must be cubic or linear, not " + in_quotes(interpolation_));
  if (limiter_ && *limiter_ != "on" && *limiter_ != "off")
    return Error("--limiter must be on or off, not " + in_quotes(*limiter_));
  if (limiter_) options.limit = *limiter_ == "on";
  options.visibility = visibility_ == "on";
  options.interpolation =
      interpolation_ == "linear" ? Interpolation::kLinear : Interpolation::kCubic;
  options.rays = rays_;
  if (memory_) {
    const auto bytes = parse_bytes(*memory_);
    if (!bytes.ok()) return Error("--memory " + bytes.error().message);
    options.memory_bytes = *bytes;
  }
  constexpr double kMaxOutputGain = 1e10;  // 200 dB
  const auto amplitude = parse_gain(gain_, kMaxOutputGain);
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
  options.takes_parts = script->parts().adds_parts();
  options.script = std::make_shared<MovingScript>(std::move(*script));
  return {};
}

}  // namespace clamor
