// part_scene.h: the movable parts of a level where they are now, for rays.
//
// Threads: update() on the sampler's, while no rays are cast; const functions on any number of
// threads at once.   Cost: moving 100 parts takes 0.1 ms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/diffracting_edges.h"
#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/occluder_plane.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/occlusion/path_segment.h"

namespace clamor {

class EmbreeInstances;

// The bounds of a part where it was or is.
using PartBounds = Boundsf;

class PartScene {
 public:
  PartScene();
  ~PartScene();

  // Takes over all parts as they are now. Returns where they have appeared, moved or vanished: the
  // bounds before and after. Valid until the next call.
  std::span<const PartBounds> update(const MovingParts& moved);
  bool is_up_to_date(const MovingParts& moved) const { return moved.version() == taken_; }

  // The number of updates that changed anything.
  std::uint64_t version() const { return version_; }
  bool empty() const { return present_ == 0; }
  bool transmits() const { return transmitting_ > 0; }  // whether any part does

  // Appends the faces of the part in a slot (part_shape.h) where it is now; none if it is empty.
  std::size_t slots() const { return parts_.size(); }
  void add_faces(std::size_t slot, std::vector<PartShape::Face>& faces) const;

  // A triangle of a part that a ray meets.
  struct Hit {
    float fraction = 0;  // of the segment
    std::uint32_t part = 0, triangle = 0;
  };
  // The first hit of the segment between the fractions `near` and `far`.
  std::optional<Hit> first_hit(const Vec3f& from_m, const Vec3f& to_m, float near, float far) const;
  bool is_free(const Vec3f& from_m, const Vec3f& to_m) const;

  // Adds the edges of parts to `found`, which is in the order of detours and stays so, with at most
  // `count` edges.
  void find_edges(const Vec3& from_m, const Vec3& to_m, std::size_t count, double longest_m,
                  std::vector<EdgeBetween>& found) const;

  // Replaces the surfaces of the segments in `lanes` that a part hides. `fractions` are those of
  // the surfaces, 1 where there is none.
  void first_hits(std::span<const PathSegment, kPacketRays> segments, std::uint32_t lanes,
                  std::span<float, kPacketRays> fractions,
                  std::span<std::optional<OccluderPlane>, kPacketRays> surfaces) const;

  OccluderPlane plane(const Hit& hit) const { return plane(hit.part, hit.triangle); }
  const Bands& transmission(const Hit& hit) const;
  const Bands& mirrored(const Hit& hit) const;  // the share that it reflects as a mirror

  // Grows with each change of the part in a slot.
  std::uint32_t version_of(std::size_t slot) const {
    return slot < parts_.size() ? parts_[slot].version : 0;
  }

 private:
  struct Part {
    std::shared_ptr<const PartShape> shape;  // null: there is none, or it is disabled
    Matrix axes{1};                          // rotation times scale
    Vec3 position_m{};
    double scale = 1;
    std::uint32_t version = 0;
    PartBounds bounds;
  };
  OccluderPlane plane(std::uint32_t part, std::uint32_t triangle) const;
  void take_over(std::size_t slot, const MovingParts::Part& from);

  std::unique_ptr<EmbreeInstances> instances_;  // null until there is a part
  std::vector<Part> parts_;                     // by slot
  std::vector<PartBounds> changed_;
  std::size_t present_ = 0, transmitting_ = 0;
  std::uint64_t taken_ = 0;  // version of the moving parts
  std::uint64_t version_ = 0;
};

}  // namespace clamor
