// output_stage.h: how an auralizer makes its output channels, and whether it mixes a field.
#pragma once

#include <memory>

#include "common/result.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/mixing/panner.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

struct AuralizerInput;
struct AuralizerOptions;

// An Error where a field is asked for that cannot be; Mixing::kAuto mixes voices there.
Result<void> check_mixing(const AuralizerOptions& options);

struct OutputStage {
  // Fails as check_mixing() does.
  static Result<OutputStage> of(const AuralizerOptions& options, const AuralizerInput& input);

  KeyframeMaker::Receivers receivers() const;
  // Of voices, for samples of at most so many sources.
  std::size_t slots(std::size_t sources) const;

  std::unique_ptr<const Panner> panner;  // or null
  std::shared_ptr<const Hrtf> hrtf;      // or null
  MixMode mode;
  bool chooses_taps = false;  // of a field: all sources may be voices (tap_choice.h)
  std::size_t field_voices;   // of a field
};

}  // namespace clamor
