// expanded_sources.h: every source of a bake at once, those of copies where the copies stand.
#pragma once

#include <cstdint>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/bake_file.h"

namespace clamor {

struct ExpandedSources {
  std::vector<Source> sources;
  // The file's, and after them those that play another signal because they stand in a copy.
  std::vector<Emitter> emitters;
  std::vector<std::uint32_t> stored_as;  // per emitter: which of the file's it is
};

// In the order in which the sampler numbers them: a node's own, then those below, then its copies.
// Memory grows with the number; more than kMaxExpandedSources are refused.
inline constexpr std::uint64_t kMaxExpandedSources = 1 << 27;
Result<ExpandedSources> read_expanded_sources(const BakeFile& file);

}  // namespace clamor
