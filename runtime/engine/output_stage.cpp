#include "runtime/engine/output_stage.h"

#include <string>
#include <utility>

#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/sampling_pipeline.h"
#include "runtime/mixing/field_maker.h"
#include "runtime/sampling/sampling_strategy.h"

namespace clamor {

namespace {

// What speaks against a field, or null.
const char* why_no_field(const AuralizerOptions& options, const AuralizerInput& input) {
  if (strategy_options_of(options).name() != priority_strategy()->name())
    return "takes the strategy 'priority', with as many voices as are to be heard";
  if (options.moving.max_sources > 0) return "has no moving sources";
  if (!FieldMaker::suits(input.emitters))
    return "has at most 64 signals that begin at different times";
  return nullptr;
}

}  // namespace

Result<OutputStage> OutputStage::of(const AuralizerOptions& options, const AuralizerInput& input) {
  OutputStage stage{options.output.make_panner(), options.output.head, {}};
  MixMode& mode = stage.mode;
  mode.interpolation = options.interpolation;
  mode.head = stage.hrtf != nullptr;
  if (stage.panner != nullptr) {
    mode.delays = 1;  // panned voices have one delay, binaural ones two
    mode.pairs = stage.panner->channels() / kEars;
  }
  if (options.mixing == Mixing::kVoices) return stage;
  const char* const why = why_no_field(options, input);
  if (why != nullptr && options.mixing == Mixing::kField)
    return Error(std::string("a field ") + why + "; mix voices, or let 'auto' choose.");
  mode.field = why == nullptr && options.mixes_voices &&
               (options.mixing == Mixing::kField || options.voices >= kLeastField);
  return stage;
}

KeyframeMaker::Receivers OutputStage::receivers() const {
  return panner == nullptr && hrtf == nullptr ? KeyframeMaker::Receivers::kPair
                                              : KeyframeMaker::Receivers::kOne;
}

}  // namespace clamor
