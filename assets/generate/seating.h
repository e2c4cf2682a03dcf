// seating.h: positions and sounds of the fans, block by block.
//
// A stadium is made of a few kinds of block, repeated: those of the long sides, of the short sides
// and of either half of a corner, in two tiers. Fans are drawn once for each kind; the blocks of a
// kind have the same fans in the same seats, but sing other songs and takes, and begin later.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "bowl.h"
#include "crowd.h"
#include "gltf_writer.h"

namespace clamor::assets {

// Fans of a kind of block that make the same sound, as long as the block has no song of its own.
struct FanGroup {
  std::size_t sound;
  std::vector<Instance> fans;  // seen from the block's corner
};

struct BlockKind {
  std::vector<FanGroup> groups;
  std::size_t seats = 0;
};

struct Block {
  std::string name;
  std::size_t kind;
  std::size_t stand;  // 0 to 7: a side, a corner, and so on round the bowl
  Vec3 corner_m;
  double yaw_rad;                   // of -Z of the kind
  double delay_s;                   // of all its fans
  std::vector<std::size_t> sounds;  // replacement of each sound
};

struct Seating {
  std::vector<BlockKind> kinds;
  std::vector<Block> blocks;
};

// Ranges of the random delays after which fans begin; in a loop, a delay is a phase.
struct StartTimes {
  double in_unison_s;  // among fans who join in what their block does
  double alone_s;      // among all others of a block
  double of_block_s;   // among blocks
};
inline constexpr StartTimes kPaperStarts{0.2, 0.2, 0.1};
inline constexpr StartTimes kAnyStarts{0.2, 10, 10};

// `fan_count` fans, whose mouths are `mouth_m` above their feet, denser low down and along the
// sides.
Seating make_seating(const Bowl& bowl, std::span<const CrowdSound> sounds, const StartTimes& starts,
                     std::size_t fan_count, double mouth_m);

}  // namespace clamor::assets
