#include "runtime/probes/combined_pool.h"

#include <algorithm>
#include <span>

#include "runtime/propagation/source_number.h"

namespace clamor {

void CombinedPool::charge(WorkBudget* budget) {
  SourcePool::charge(budget);
  static_.charge(budget);
  if (images_ != nullptr) images_->charge(budget);
  if (probes_ != nullptr) probes_->charge(budget);
}

bool CombinedPool::refresh() {
  const bool moved = moving_ != nullptr && moving_->refresh();
  const bool reflected = probes_ != nullptr && probes_->refresh();
  return static_.refresh() || moved || reflected;
}

void CombinedPool::begin(const Listener& listener, double time_s) {
  static_.begin(listener, time_s);
  if (moving_ != nullptr) moving_->begin(time_s);
  if (probes_ != nullptr) probes_->begin(listener, time_s);
  if (part_images_ != nullptr) part_images_->begin(listener.position_m, time_s);
}

void CombinedPool::set_occlusion_bounds(const OcclusionUpperBounds* bounds) {
  static_.set_occlusion_bounds(bounds);
  if (probes_ != nullptr) probes_->set_occlusion_bounds(bounds);
}

void CombinedPool::set_late_boost(float strength) {
  static_.set_late_boost(strength);
  if (images_ != nullptr) images_->set_late_boost(strength);
  if (probes_ != nullptr) probes_->set_late_boost(strength);
}

bool CombinedPool::find_above(const Vec3& place, double threshold, std::size_t max_count,
                              std::vector<FoundSource>& found) {
  if (!static_.find_above(place, threshold, max_count, found)) return false;
  if (images_ != nullptr) find_images(place, threshold, found);
  if (part_images_ != nullptr) {
    const std::size_t before = found.size();
    part_images_->find_above(threshold, found);
    spend(WorkBudget::kFound * (found.size() - before));
  }
  if (moving_ != nullptr) {
    const std::size_t before = found.size();
    moving_->find_above(place, threshold, found);
    spend(WorkBudget::kFound * (found.size() - before) +
          WorkBudget::kMovingPer16 * (moving_->max_sources() / 16));
  }
  // A threshold of zero asks for all sources, however many there are.
  const std::size_t limit = threshold == 0 ? found.max_size() : max_count;
  if (probes_ != nullptr && !probes_->find_above(place, threshold, limit, found)) return false;
  return found.size() <= limit && !is_exhausted();
}

void CombinedPool::find_images(const Vec3& place, double threshold,
                               std::vector<FoundSource>& found) {
  const std::size_t before = found.size();
  images_->find_above(place, threshold, images_->size(), found);
  for (FoundSource& one : std::span(found).subspan(before)) one.number += kFirstImage;
}

double CombinedPool::upper_bound(const Vec3& place) {
  double of_others =
      std::max(static_.upper_bound(place), moving_ == nullptr ? 0 : moving_->upper_bound(place));
  if (part_images_ != nullptr) of_others = std::max(of_others, part_images_->upper_bound());
  return probes_ == nullptr ? of_others : std::max(of_others, probes_->upper_bound(place));
}

double CombinedPool::missing_key(const FoundSource& found, double threshold) {
  if (found.source->is_image) return 0;
  if (found.voice == 0) return static_.missing_key(found, threshold);
  return found.frame == 0 ? 0 : probes_->missing_key(found);
}

void CombinedPool::request_pages(const Vec3& next_place, double threshold) {
  static_.request_pages(next_place, threshold);
  if (probes_ != nullptr) probes_->request_pages(threshold);
}

bool CombinedPool::lacks_pages() const {
  return static_.lacks_pages() || (probes_ != nullptr && probes_->lacks_pages());
}

bool CombinedPool::complete() {
  const bool is_complete = static_.complete();
  return (probes_ == nullptr || probes_->complete()) && is_complete;
}

// Copies of probes count as many: only whether there are fewer sources than voices matters.
std::uint64_t CombinedPool::size() const {
  const std::uint64_t others = static_.size() + (images_ == nullptr ? 0 : images_->size()) +
                               (moving_ == nullptr ? 0 : moving_->max_sources()) +
                               (part_images_ == nullptr ? 0 : PartImages::kMaxImages);
  return probes_ == nullptr ? others : others + (std::uint64_t{1} << 32);
}

}  // namespace clamor
