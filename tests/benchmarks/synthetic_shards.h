// synthetic_shards.h: shards of a bake whose deposits are drawn at random instead of traced, for
// benchmarks of merges.
//
// The level is a box of 20 x 8 x 15 m with one emitter. Each run of 1024 photons has some 40 000
// deposits, all shards together 1.25 for each source that the bake keeps, as a traced bake has.
// Deposits lie on the walls, with delays of up to 1.5 s and powers that fall by 60 dB within them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bake/bake_request.h"
#include "common/result.h"
#include "tests/box_level.h"

namespace clamor {
struct ShardNote;
}

namespace clamor::testing {

class SyntheticShards {
 public:
  // Files are written to `folder`, which must outlive them.
  SyntheticShards(const Folder& folder, std::uint64_t sources, std::uint32_t shards);

  Result<void> write();

  const std::vector<std::string>& paths() const { return paths_; }
  std::uint64_t bytes() const { return bytes_; }  // of all shards, after write()

 private:
  class Writer;

  BakeRequest request_;
  std::vector<std::string> paths_;
  std::uint64_t photons_, deposits_, bytes_ = 0;
};

}  // namespace clamor::testing
