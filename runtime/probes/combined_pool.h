// combined_pool.h: the sources of a level, its image sources, moving sources, the reflections of
// these, and images in movable parts.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/probes/part_images.h"
#include "runtime/probes/probe_pool.h"
#include "runtime/query/source_pool.h"
#include "runtime/sampling/moving_source_list.h"

namespace clamor {

class CombinedPool final : public SourcePool {
 public:
  // Each of the latter may be null. Without `probes`, moving sources are heard directly only.
  CombinedPool(SourcePool& static_pool, MovingSourceList* moving, ProbePool* probes = nullptr,
               SourceList* images = nullptr, PartImages* part_images = nullptr)
      : static_(static_pool),
        images_(images),
        moving_(moving),
        probes_(probes),
        part_images_(part_images) {}

  void charge(WorkBudget* budget) override;
  bool refresh() override;
  void begin(const Listener& listener, double time_s) override;
  void set_occlusion_bounds(const OcclusionUpperBounds* bounds) override;
  void set_late_boost(float strength) override;
  bool find_above(const Vec3& place, double threshold, std::size_t max_count,
                  std::vector<FoundSource>& found) override;
  double upper_bound(const Vec3& place) override;
  double missing_key(const FoundSource& found, double threshold) override;
  void request_pages(const Vec3& next_place, double threshold) override;
  bool lacks_pages() const override;
  bool complete() override;
  std::uint64_t size() const override;

 private:
  void find_images(const Vec3& place, double threshold, std::vector<FoundSource>& found);

  SourcePool& static_;
  SourceList* images_;
  MovingSourceList* moving_;
  ProbePool* probes_;
  PartImages* part_images_;
};

}  // namespace clamor
