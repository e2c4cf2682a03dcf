#include "runtime/engine/sampling_pipeline.h"

#include <algorithm>
#include <utility>

namespace clamor {

StrategyOptions strategy_options_of(const AuralizerOptions& options) {
  return {options.strategy, static_cast<std::size_t>(std::max(options.voices, 0)),
          options.estimator, options.tuning,
          options.wait_for_pages ? SearchBound::kUnbounded : SearchBound::kBounded};
}

bool looks(const AuralizerOptions& options) {
  return options.visibility && uses_occlusion(options.strategy);
}

SamplingPipeline::SamplingPipeline(AuralizerInput& input, const BakeFile* file,
                                   const RadiationModel& field, const SignalWeights& weights,
                                   const SignalWeights& ceilings, std::uint64_t sounds_bytes,
                                   const AuralizerOptions& options) {
  const StrategyOptions strategy = strategy_options_of(options);
  add_occlusion(input, field, options);
  SourceList* listed = nullptr;
  if (file != nullptr) {
    loader_ = std::make_unique<PageLoader>(
        page_fetch(*file, field, ceilings),
        PageBudget{options.memory_bytes - std::min(sounds_bytes, options.memory_bytes / 2),
                   !options.wait_for_pages},
        1, [file](const PageEntry& entry) { file->will_need(entry); });
    pool_ =
        std::make_unique<OctreePool>(field, ceilings, file->trees(), file->signal_maps(), *loader_);
  } else {
    auto list = std::make_unique<SourceList>(field, weights, std::move(input.sources));
    listed = list.get();
    pool_ = std::move(list);
  }
  join_moving(input, field, weights, options.moving);
  SourcePool& all = joined_ != nullptr ? *joined_ : *pool_;
  sampler_ = listed != nullptr && needs_list(options.strategy)
                 ? make_sampler(strategy, field, weights, *listed, occlusion_.get(), movers_.get())
                 : make_sampler(strategy, field, weights, all, occlusion_.get());
}

void SamplingPipeline::add_occlusion(const AuralizerInput& input, const RadiationModel& field,
                                     const AuralizerOptions& options) {
  if (!looks(options) || input.mesh.triangles.empty()) return;
  using BuildQuality = OcclusionGeometry::BuildQuality;
  surfaces_ = std::make_unique<OcclusionGeometry>(
      input.mesh, input.materials,
      options.wait_for_pages ? BuildQuality::kHigh : BuildQuality::kFast);
  occlusion_ = std::make_unique<VisibilityCache>(
      *surfaces_, field.speed_of_sound_mps(),
      VisibilityOptions{.rays_per_keyframe = options.rays, .exact = options.wait_for_pages});
}

void SamplingPipeline::improve_occlusion() {
  if (surfaces_ != nullptr) surfaces_->improve();
}

// In one ranking with the others.
void SamplingPipeline::join_moving(const AuralizerInput& input, const RadiationModel& field,
                                   const SignalWeights& weights, const MovingOptions& options) {
  if (options.max_sources == 0) return;
  moving_ = std::make_unique<MovingSources>(options.max_sources, options.kinds.size());
  movers_ = std::make_unique<MovingSourceList>(*moving_, field, weights.by_signal, input.emitters,
                                               options.kinds.size());
  joined_ = std::make_unique<CombinedPool>(*pool_, *movers_);
}

}  // namespace clamor
