#include "runtime/engine/output_stage.h"

#include <algorithm>
#include <utility>

#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/sampling_pipeline.h"
#include "runtime/mixing/field_maker.h"
#include "runtime/sampling/sampling_strategy.h"

namespace clamor {

namespace {

bool asks_for_field(const AuralizerOptions& options) {
  return options.mixing == Mixing::kField || options.has_dense_late;
}

bool is_sampled(const AuralizerOptions& options) {
  return strategy_options_of(options).name() == priority_strategy()->name();
}

}  // namespace

Result<void> check_mixing(const AuralizerOptions& options) {
  if (options.mixing == Mixing::kVoices && options.has_dense_late)
    return Error(
        "voices have late sound as stored, and only a field makes it dense: mix a field, or let "
        "'auto' choose.");
  if (asks_for_field(options) && !is_sampled(options))
    return Error(
        "a field, which dense late sound needs, takes the strategy 'priority', with as many voices "
        "as are to be heard; leave out the other strategy, or mix voices.");
  return {};
}

Result<OutputStage> OutputStage::of(const AuralizerOptions& options, const AuralizerInput& input) {
  OutputStage stage{options.output.make_panner(),
                    options.output.head,
                    {},
                    false,
                    std::max<std::size_t>(options.field_voices, 1)};
  MixMode& mode = stage.mode;
  mode.interpolation = options.interpolation;
  mode.head = stage.hrtf != nullptr;
  if (stage.panner != nullptr) {
    mode.delays = 1;  // panned voices have one delay, binaural ones two
    mode.pairs = stage.panner->channels() / kEars;
  }
  if (auto mixes = check_mixing(options); !mixes.ok()) return mixes.error();
  if (options.mixing == Mixing::kVoices) return stage;
  const bool suits =
      FieldMaker::suits(input.emitters, static_cast<std::size_t>(std::max(options.voices, 1)));
  stage.chooses_taps = options.moving.max_sources > 0 || !suits;
  mode.field = is_sampled(options) && options.mixes_voices &&
               (asks_for_field(options) || (suits && options.voices >= kLeastField));
  return stage;
}

KeyframeMaker::Receivers OutputStage::receivers() const {
  return panner == nullptr && hrtf == nullptr ? KeyframeMaker::Receivers::kPair
                                              : KeyframeMaker::Receivers::kOne;
}

// Voices that fade out count too. Three samples' worth is full only when the listener jumps about.
std::size_t OutputStage::slots(std::size_t sources) const {
  const bool has_few = mode.field && !chooses_taps;
  return 3 * (has_few ? std::min(field_voices, sources) : sources);
}

}  // namespace clamor
