#include "tools/strategies/all_sampler.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "runtime/occlusion/visibility_cache.h"
#include "runtime/sampling/moving_source_list.h"

namespace clamor {

namespace {

class All final : public Sampler {
 public:
  All(const RadiationModel& radiation, const SourceList& list, VisibilityCache* occlusion,
      MovingSourceList* moving)
      : occlusion_(occlusion), moving_(moving), still_(list.page().size()) {
    const SourcePage& page = list.page();
    for (std::size_t i = 0; i < page.size(); ++i)
      sample_.push_back({i, 1, &page[i], radiation.signal(page[i])});
  }
  std::span<const SampledSource> sample(const Listener& listener, double time_s) override {
    const Vec3& place = listener.position_m;
    if (occlusion_ != nullptr &&
        (place_ != place || moving_ != nullptr || occlusion_->has_changed_parts())) {
      occlusion_->begin_keyframe(place);
      wanted_.clear();
      for (const SampledSource& one : std::span(sample_).first(still_))
        wanted_.push_back({.number = one.number, .source = one.source});
      for (std::size_t first = 0; first < still_ && !is_stopped(); first += kTogether) {
        const std::size_t count = std::min(kTogether, still_ - first);
        const std::vector<Bands> visible =
            occlusion_->estimate_now(std::span(wanted_).subspan(first, count));
        for (std::size_t i = 0; i < count; ++i) sample_[first + i].factors.occlusion = visible[i];
      }
    }
    place_ = place;
    if (moving_ != nullptr) add_moving(listener, time_s);
    return sample_;
  }
  bool complete() override { return true; }
  void stop_when(const std::atomic<bool>* stop) override { stop_ = stop; }
  std::size_t capacity() const override {
    return still_ + (moving_ != nullptr ? moving_->size() : 0);
  }

 private:
  // Visibilities between which sampling may be stopped.
  static constexpr std::size_t kTogether = 1 << 16;

  bool is_stopped() const { return stop_ != nullptr && stop_->load(std::memory_order_relaxed); }

  void add_moving(const Listener& listener, double time_s) {
    moving_->refresh();
    moving_->begin({listener, time_s});
    found_.clear();
    moving_->find_above(0, found_.max_size(), found_);
    sample_.resize(still_);
    for (const FoundSource& found : found_) {
      SampledSource& sampled =
          sample_.emplace_back(SampledSource{found.number, 1, found.source, found.signal});
      sampled.set_moving(found);
      if (occlusion_ != nullptr)
        sampled.factors.occlusion = occlusion_->estimate_now(found.number, *found.source);
    }
  }

  VisibilityCache* const occlusion_;
  const std::atomic<bool>* stop_ = nullptr;
  MovingSourceList* const moving_;
  const std::size_t still_;  // of sample_, in front
  std::vector<FoundSource> found_;
  std::vector<VisibilityCache::Wanted> wanted_;
  std::optional<Vec3> place_;  // of sample_
  std::vector<SampledSource> sample_;
};

}  // namespace

std::unique_ptr<Sampler> make_all_sampler(const RadiationModel& radiation, const SourceList& list,
                                          VisibilityCache* occlusion, MovingSourceList* moving) {
  return std::make_unique<All>(radiation, list, occlusion, moving);
}

}  // namespace clamor
