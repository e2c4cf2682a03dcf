// part_mirror.h: carries the movable parts of a world over to one auralizer.
//
// Threads: the sampler's.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/occlusion/moving_parts.h"
#include "runtime/world/world_parts.h"

namespace clamor {

class Auralizer;

class PartMirror {
 public:
  // The auralizer, which must outlive this, has the parts of `level`.
  PartMirror(Auralizer& auralizer, std::uint64_t level) : auralizer_(auralizer), level_(level) {}

  // Takes over a commit. Parts that there is no room for are left out.
  void take_over(std::span<const WorldParts::Committed> committed);

 private:
  struct Slot {
    std::uint64_t handle = 0, version = 0;  // of the world
    PartHandle part{};                      // of the auralizer; generation 0: none
    bool is_added = false;
  };

  void take_over(const WorldParts::Committed& committed, Slot& slot);

  Auralizer& auralizer_;
  const std::uint64_t level_;
  std::vector<Slot> slots_;
};

}  // namespace clamor
