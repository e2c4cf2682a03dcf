// shard_set.h: checks that shards belong together, from what they say about themselves.
#pragma once

#include <string>
#include <vector>

#include "bake/journal/shard_note.h"
#include "common/result.h"

namespace clamor {

// The note of what the shards are together. Fails with the name of the first that is no shard or
// incomplete, or that another version made, or with other options than the first. Does not read
// the runs: open_shard() in bake.cpp checks their checksums.
Result<ShardNote> note_of_shards(const std::vector<std::string>& paths);

// Fails if a shard of the bake is missing.
Result<void> check_all_there(const ShardNote& together);

// Fails with the name of the first shard that was traced from another state of the level.
Result<void> check_level_hash(const std::vector<std::string>& paths, std::uint64_t level_hash,
                              const std::string& level_path);

}  // namespace clamor
