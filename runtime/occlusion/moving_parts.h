// moving_parts.h: parts of a level that a game moves, adds and removes while it plays.
//
//   const auto shape = PartShape::make(box_mesh({0.5, 1, 0.02}, 0), materials);
//   const auto door = parts.add(*shape, {.position_m = {3, 1, 0}});
//   ... before each keyframe, for all that move ...
//   parts.move(*door, pose);
//
// A part occludes what is behind it, per band, transmits what its materials do, and reflects as a
// mirror (part_images.h).
//
// Threads: the sampler's; applications hand over whole commits (runtime/world).   Memory: 80 bytes
// per part, besides the shapes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/level/movable_part.h"

namespace clamor {

class PartShape;

// Identifies a part from add() to remove(), and never another one.
struct PartHandle {
  std::uint32_t slot = 0, generation = 0;  // generation 0: no part
};

class MovingParts {
 public:
  // Poses that are given are in the world's coordinates, those of parts() relative to `origin_m`.
  explicit MovingParts(const Vec3& origin_m = Vec3(0)) : origin_m_(origin_m) {}

  // Errors: there are kMaxMovableParts already; a number out of range.
  Result<PartHandle> add(std::shared_ptr<const PartShape> shape, const PartPose& pose);

  // Errors, after which nothing has changed: no such part; a number out of range.
  Result<void> move(PartHandle handle, const PartPose& pose);
  Result<void> enable(PartHandle handle, bool enabled);  // a disabled part occludes nothing
  Result<void> remove(PartHandle handle);

  std::size_t size() const { return present_; }

  struct Part {
    std::shared_ptr<const PartShape> shape;  // null: there is none
    PartPose pose;                           // with a rotation of unit length
    bool enabled = true;
    std::uint32_t version = 0;  // grows with every change
  };
  std::span<const Part> parts() const { return parts_; }  // by slot
  std::uint64_t version() const { return version_; }      // grows with every change

 private:
  bool is_present(PartHandle handle) const;
  void mark_changed(std::size_t slot);
  PartPose in_level(PartPose pose) const;

  const Vec3 origin_m_;
  std::vector<Part> parts_;             // by slot
  std::vector<std::uint32_t> handles_;  // generations, by slot; even: no part
  std::vector<std::uint32_t> free_;     // slots
  std::size_t present_ = 0;
  std::uint64_t version_ = 0;
};

}  // namespace clamor
