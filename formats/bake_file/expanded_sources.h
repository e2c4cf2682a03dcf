// expanded_sources.h: all sources of a bake with instances expanded.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/image_source.h"
#include "formats/level/emitter.h"

namespace clamor {

struct ExpandedSources {
  std::vector<Source> sources;
  // Emitters of the file and virtual ones, then variants that play another signal in an instance.
  std::vector<Emitter> emitters;
  std::vector<std::uint32_t> stored_as;  // per emitter: its index in the file's emitters()
};

// The sources of images, which are not in the pages of a file. An image is chosen whenever it is
// loud enough, and then has its exact level: u is 1.
std::vector<Source> image_sources(std::span<const ImageSource> images,
                                  const std::vector<Emitter>& emitters);

// All portals are open: sources of the closed state (portal.h) are left out. Without these, the
// order is that of the sampler's source numbers: sources of a node, of its children, of its
// instances; images come last. Memory is proportional to their number; more than
// kMaxExpandedSources are an Error.
inline constexpr std::uint64_t kMaxExpandedSources = 1 << 27;
Result<ExpandedSources> read_expanded_sources(const BakeFile& file);

// The sources of highest key, of a file of any size. All sources whose key is above `missing_key`
// are among them, and no others but images, so each of the file's is there with probability
// min(1, P / missing_key), P its power over all bands: scaled by max(1, missing_key / P), powers
// are unbiased.
struct StrongestSources : ExpandedSources {
  double missing_key = 0;  // 0: these are all sources
};

// At most `count` of them and the images. Reads the pages from the top of the octree down as far as
// needed.
Result<StrongestSources> read_strongest_sources(const BakeFile& file, std::size_t count);

}  // namespace clamor
