// moving_parts.h: parts of a level that a game moves, adds and removes while it plays.
//
//   const auto shape = PartShape::make(box_mesh({0.5, 1, 0.02}, 0), materials);
//   const auto door = parts.add(*shape, {.position_m = {3, 1, 0}});
//   ... once per frame of the game, for all that move ...
//   parts.move(*door, pose);
//   parts.commit();
//
// Changes take effect together, in the first keyframe after their commit(). A part occludes what is
// behind it, per band, transmits what its materials do, and reflects as a mirror (part_images.h).
//
// Threads: add, move, enable, remove and commit on one thread, the caller's; the sampler's thread
// reads the newest commit (a triple buffer, swapped by one atomic exchange). Neither waits.
// Memory: 80 bytes per part and three copies of that, besides the shapes.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
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
  // Poses that are given are in the world's coordinates, those of snapshots relative to `origin_m`.
  explicit MovingParts(const Vec3& origin_m = Vec3(0)) : origin_m_(origin_m) {}

  // Errors: there are kMaxMovableParts already; a number out of range.
  Result<PartHandle> add(std::shared_ptr<const PartShape> shape, const PartPose& pose);

  // Errors, after which nothing has changed: no such part; a number out of range.
  Result<void> move(PartHandle handle, const PartPose& pose);
  Result<void> enable(PartHandle handle, bool enabled);  // a disabled part occludes nothing
  Result<void> remove(PartHandle handle);

  void commit();

  std::size_t size() const { return present_; }

  // ---- The sampler's side --------------------------------------------------------------------

  struct Part {
    std::shared_ptr<const PartShape> shape;  // null: there is none
    PartPose pose;                           // with a rotation of unit length
    bool enabled = true;
    std::uint32_t version = 0;  // grows with every change
  };
  struct Snapshot {
    std::vector<Part> parts;  // by slot
    std::uint64_t commits = 0;
  };

  // Returns whether there is a commit that latest() has not returned yet.
  bool has_pending_commit() const noexcept {
    return (middle_.load(std::memory_order_relaxed) & kFresh) != 0;
  }
  // The newest commit; valid until the next call.
  const Snapshot& latest() noexcept;

 private:
  static constexpr unsigned kCopy = 3, kFresh = 4;

  bool is_present(PartHandle handle) const;
  void mark_changed(std::size_t slot);
  PartPose in_level(PartPose pose) const;

  const Vec3 origin_m_;
  Snapshot own_;                                     // the caller's, to copy from
  std::vector<std::uint32_t> handles_;               // generations, by slot; even: no part
  std::vector<std::uint32_t> free_;                  // slots
  std::array<std::vector<std::uint32_t>, 3> stale_;  // slots that a copy lacks, by copy
  std::vector<std::uint8_t> stale_in_;               // the same as bits, by slot
  std::size_t present_ = 0;
  bool has_changed_ = false;

  std::array<Snapshot, 3> copies_;
  unsigned writing_ = 0;                         // the caller's alone
  alignas(64) std::atomic<unsigned> middle_{1};  // index of a copy, | kFresh until read
  alignas(64) unsigned reading_ = 2;             // the sampler's alone
};

}  // namespace clamor
