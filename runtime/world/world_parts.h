// world_parts.h: the movable parts that an application moves: those of levels that it has asked
// for, and those that it adds.
//
// Changes are collected until commit(), as those of sources are (world_sources.h).
//
// Threads: one at a time; WorldSources guards it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "formats/level/movable_part.h"
#include "runtime/world/handle_table.h"

namespace clamor {

class PartShape;

struct WorldPart {
  static constexpr std::uint32_t kAdded = 0xffffffff;

  std::uint64_t level = 0;       // handle of its level, or of the only one where it is; 0: all
  std::uint32_t index = kAdded;  // of the level's parts
  std::shared_ptr<const PartShape> shape{};  // of an added part
  const char* name = "";                     // of a level's part: the level's as long as it is open
  std::size_t triangles = 0;
  PartPose pose;
  bool enabled = true;

  bool is_added() const { return index == kAdded; }
};

class WorldParts {
 public:
  // `tag` distinguishes handles.
  explicit WorldParts(std::uint64_t tag);

  // Handles of parts, or 0 if there are kMaxMovableParts already. A level's part has the same
  // handle each time. Poses are in the world, and `origin_m` is that of the level.
  std::uint64_t add(WorldPart part);
  std::uint64_t of_level(std::uint64_t level, std::uint32_t index, const MovablePart& part,
                         const Vec3& origin_m);

  std::optional<WorldPart> find(std::uint64_t handle) const;

  // False if the handle names nothing. The pose must be right.
  bool move(std::uint64_t handle, const PartPose& pose);
  bool enable(std::uint64_t handle, bool enabled);
  bool remove(std::uint64_t handle);

  // Forgets the parts of a level that is closed. Listeners who are still there hear them as they
  // are.
  void forget_level(std::uint64_t level);

  // A part as of the last commit, by slot.
  struct Committed {
    std::uint64_t handle = 0;   // 0: none
    std::uint64_t version = 0;  // grows with each change
    WorldPart part;
  };

  // Brings `committed` up to date.
  void commit(std::vector<Committed>& committed);

 private:
  struct Part {
    WorldPart now;
    std::uint64_t version = 1;
  };
  HandleTable<Part> parts_;
  std::map<std::pair<std::uint64_t, std::uint32_t>, std::uint64_t> of_levels_;  // handles
  bool has_changed_ = false;
};

}  // namespace clamor
