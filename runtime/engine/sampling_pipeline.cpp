#include "runtime/engine/sampling_pipeline.h"

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/engine/sample_schedule.h"
#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/probes/combined_pool.h"
#include "runtime/probes/part_images.h"
#include "runtime/probes/probe_pool.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/moving_source_list.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/sampling/sampler.h"
#include "runtime/sampling/sampling_strategy.h"
#include "runtime/streaming/page_loader.h"
#include "runtime/streaming/prepared_signal.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

// Weights by the level of the moment. A source that is sampled less often must be chosen earlier,
// so that it has faded in when its sound begins.
SignalWeights weights_over_time(const AuralizerInput& input, std::size_t keyframes) {
  EnvelopeSmoothing smoothing;
  smoothing.around_s += static_cast<double>(keyframes - 1) * kKeyframe_s;
  if (!input.envelopes.empty()) return make_signal_weights(input.envelopes, smoothing);
  std::vector<TimedEnvelope> envelopes;
  for (const Signal& signal : input.signals)
    envelopes.push_back({SignalEnvelope(signal), signal.samples.size(), signal.loop});
  return make_signal_weights(envelopes, smoothing);
}

// The number of emitters that are the level's own: virtual ones and kinds of moving sources follow.
// None where they are instances of others, which are elsewhere.
std::size_t level_emitters(const AuralizerInput& input, const BakeFile* file,
                           const AuralizerOptions& options) {
  if (file != nullptr && file->trees().size() > 1) return 0;
  return input.emitters.size() - kinds_of(options.moving) - input.portals.emitters.size();
}

// Reads pages, and reports those that cannot be read.
PageLoader::Fetch reporting(PageLoader::Fetch fetch,
                            const std::function<void(const char*)>& report) {
  if (!report) return fetch;
  return [fetch = std::move(fetch), report](const PageEntry& entry) {
    auto content = fetch(entry);
    if (!content.ok()) report(content.error().message.c_str());
    return content;
  };
}

std::unique_ptr<PageLoader> make_loader(const BakeFile& file, PageLoader::Fetch fetch,
                                        std::uint64_t bytes, const AuralizerOptions& options) {
  return std::make_unique<PageLoader>(
      reporting(std::move(fetch), options.report), PageBudget{bytes, !options.wait_for_pages},
      options.own_threads ? 1 : 0, [&file](const PageEntry& entry) { file.will_need(entry); },
      options.thread_hooks);
}

}  // namespace

const SamplingStrategy& strategy_options_of(const AuralizerOptions& options) {
  return options.strategy != nullptr ? *options.strategy : *priority_strategy();
}

bool uses_occlusion(const AuralizerOptions& options) {
  return options.visibility && strategy_options_of(options).uses_occlusion();
}

bool reflects_moving_sources(const BakeFile& file, const AuralizerOptions& options) {
  return options.moving.max_sources > 0 && options.moving.reverberates &&
         !file.probes().places.empty();
}

SamplingPipeline::SamplingPipeline(AuralizerInput& input, const BakeFile* file,
                                   const RadiationModel& radiation,
                                   std::span<const PreparedSignal> signals,
                                   const MemoryBudget& memory,
                                   std::shared_ptr<std::vector<LoudnessTrack>> slot_weights,
                                   const AuralizerOptions& options, bool has_field)
    : weights_(strategy_options_of(options).needs_list()
                   ? mean_weights(signals)
                   : weights_over_time(input, has_field && options.moving.max_sources == 0
                                                  ? kMaxKeyframesPerFieldSample
                                                  : keyframes_per_sample(
                                                        static_cast<std::size_t>(options.voices)))),
      max_weights_(file == nullptr ? weights_ : max_over_instances(weights_, file->signal_maps())),
      portals_(input.portals),
      first_portal_emitter_(input.first_portal_emitter) {
  weights_.slots = std::move(slot_weights);
  add_occlusion(input, radiation, options);
  SourceList* list = nullptr;
  if (file != nullptr) {
    loader_ = make_loader(*file, page_fetch(*file, radiation, max_weights_), memory.pages, options);
    pool_ = std::make_unique<OctreePool>(radiation, max_weights_, file->trees(),
                                         file->signal_maps(), *loader_);
  } else {
    if (occlusion_ == nullptr)
      std::erase_if(input.sources, [](const Source& source) { return source.is_image; });
    auto sources = std::make_unique<SourceList>(radiation, weights_, std::move(input.sources));
    list = sources.get();
    pool_ = std::move(sources);
  }
  // Which images are heard depends on what their paths meet.
  if (occlusion_ != nullptr && !input.images.empty())
    images_ =
        std::make_unique<SourceList>(radiation, weights_, std::move(input.images), kFirstImage);
  add_moving(input, file, radiation, memory, options);
  if (parts_ != nullptr)
    part_images_ = std::make_unique<PartImages>(
        part_scene_, std::span(input.emitters).first(level_emitters(input, file, options)),
        radiation, max_weights_, moving_list_.get());
  if (images_ != nullptr || moving_list_ != nullptr || part_images_ != nullptr)
    joined_ = std::make_unique<CombinedPool>(
        std::vector<SourcePool*>{pool_.get(), images_.get(), moving_list_.get(), part_images_.get(),
                                 probes_.get(), probes_ != nullptr ? &probes_->images() : nullptr});
  sampler_ = strategy_options_of(options).make_sampler(
      {radiation, weights_, joined_ != nullptr ? *joined_ : *pool_, list, occlusion_.get(),
       moving_list_.get(), static_cast<std::size_t>(std::max(options.voices, 0)),
       options.wait_for_pages ? SearchBound::kUnbounded : SearchBound::kBounded});
  if (!portals_.sets.empty()) apply_powers();  // the closed state is silent
}

SamplingPipeline::~SamplingPipeline() = default;

void SamplingPipeline::add_surfaces(AuralizerInput& input, BvhQuality quality) {
  if (input.surfaces == nullptr)
    input.surfaces = std::make_shared<LevelSurfaces>(
        std::move(input.mesh), input.images.empty() ? input.sources : input.images);
  surfaces_ = std::make_unique<OcclusionGeometry>(input.surfaces, input.materials, quality);
}

void SamplingPipeline::add_occlusion(AuralizerInput& input, const RadiationModel& radiation,
                                     const AuralizerOptions& options) {
  const bool has_parts = options.takes_parts || !input.movable_parts.empty();
  if (!uses_occlusion(options) || (mesh_of(input).triangles.empty() && !has_parts)) return;
  add_surfaces(input, options.portable         ? BvhQuality::kPortable
                      : !options.own_threads   ? BvhQuality::kHighAlone
                      : options.wait_for_pages ? BvhQuality::kHigh
                                               : BvhQuality::kFast);
  occlusion_ = std::make_unique<VisibilityCache>(
      *surfaces_, radiation.speed_of_sound_mps(),
      VisibilityOptions{.rays_per_keyframe = options.rays, .exact = options.wait_for_pages});
  if (has_parts) add_parts(input);
}

// Parts that cannot be added are left out: the reader of bake files refuses them, and so does
// check(), which AuralizerInput has passed.
void SamplingPipeline::add_parts(const AuralizerInput& input) {
  origin_m_ = input.origin_m;
  parts_ = std::make_unique<MovingParts>(origin_m_);
  of_level_ = input.movable_parts;
  for (const MovablePart& part : input.movable_parts) {
    const auto shape = PartShape::make(part.mesh, input.materials);
    level_parts_.emplace_back();
    if (!shape.ok()) continue;
    if (const auto added = parts_->add(*shape, in_world(part.rest_pose, origin_m_)); added.ok())
      level_parts_.back() = *added;
  }
  surfaces_->set_parts(&part_scene_);
  portal_parts_ = PortalParts(portals_.portals, level_parts_);
  update_parts();
}

void SamplingPipeline::update_parts() {
  if (!has_new_parts()) return;
  occlusion_->change_parts(part_scene_.update(*parts_));
  if (portal_parts_.update(*surfaces_, part_scene_) && sampler_ != nullptr) apply_powers();
}

void SamplingPipeline::set_emitter_powers(std::vector<float> powers) {
  emitter_powers_ = std::move(powers);
  apply_powers();
}

void SamplingPipeline::set_portals(std::vector<float> openness) {
  if (openness == portal_openness_) return;
  portal_openness_ = std::move(openness);
  apply_powers();
}

// The power of a virtual emitter is that of its emitter, as far as its portals let it through.
void SamplingPipeline::apply_powers() {
  std::vector<float> openness(portal_parts_.openness().begin(), portal_parts_.openness().end());
  openness.resize(portals_.portals.size(), 1.0f);
  for (std::size_t p = 0; p < std::min(openness.size(), portal_openness_.size()); ++p)
    if (portal_openness_[p] != kOpenedByParts) openness[p] = portal_openness_[p];
  const std::vector<float> by_set = openness_by_set(portals_, openness);
  std::vector<float> powers = emitter_powers_;
  if (!portals_.emitters.empty()) {
    powers.resize(first_portal_emitter_, 1.0f);
    for (const PortalEmitter& one : portals_.emitters)
      powers.push_back(powers[one.emitter] * by_set[one.set]);
  }
  if (probes_ != nullptr) probes_->set_portals(by_set, openness);
  sampler_->set_emitter_powers(std::move(powers));
}

void SamplingPipeline::count(SamplerStatistics& counted) const {
  counted.bounded_keyframes = sampler_->bounded_keyframes();
  if (occlusion_ != nullptr) {
    counted.rays = occlusion_->statistics().rays;
    counted.late_sources = occlusion_->statistics().late;
  }
  if (probes_ == nullptr) return;
  counted.unseen_sources = static_cast<std::uint32_t>(probes_->unseen_sources());
  counted.max_unseen_sources = std::max(counted.max_unseen_sources, counted.unseen_sources);
}

void SamplingPipeline::limit_group(std::uint16_t group, std::size_t max_voices) {
  moving_list_->limit_group(group, max_voices);
}

void SamplingPipeline::forget_removed(std::uint32_t signal) {
  if (moving_list_ != nullptr) moving_list_->forget_removed(signal);
}

void SamplingPipeline::improve_occlusion() {
  if (surfaces_ != nullptr) surfaces_->improve();
}

// Moving sources share one ranking with the others.
void SamplingPipeline::add_moving(AuralizerInput& input, const BakeFile* file,
                                  const RadiationModel& radiation, const MemoryBudget& memory,
                                  const AuralizerOptions& options) {
  const MovingOptions& moving = options.moving;
  if (moving.max_sources == 0) return;
  moving_ = std::make_unique<MovingSources>(moving.max_sources, kinds_of(moving), input.origin_m);
  moving_list_ = std::make_unique<MovingSourceList>(*moving_, radiation, weights_, input.emitters,
                                                    kinds_of(moving));
  if (file != nullptr && reflects_moving_sources(*file, options))
    add_probes(input, *file, radiation, memory, options);
}

// The reflections of moving sources.
void SamplingPipeline::add_probes(AuralizerInput& input, const BakeFile& file,
                                  const RadiationModel& radiation, const MemoryBudget& memory,
                                  const AuralizerOptions& options) {
  // The input has the material of late reflections (read_tables()).
  probe_bounds_ =
      std::make_unique<const ProbeBounds>(input.materials, input.air, radiation.late_boost());
  probe_loader_ =
      make_loader(file, probe_page_fetch(file, *probe_bounds_), memory.probe_pages, options);
  if (surfaces_ == nullptr)  // nothing occludes, but first reflections come from surfaces
    add_surfaces(input, options.portable ? BvhQuality::kPortable : BvhQuality::kHigh);
  probes_ = std::make_unique<ProbePool>(
      file.probes(), *probe_bounds_, *surfaces_,
      FirstReflectionTracer(*surfaces_, input.materials, input.air, input.portals.portals),
      weights_, *moving_list_, *probe_loader_, occlusion_ != nullptr);
}

}  // namespace clamor
