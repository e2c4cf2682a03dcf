#include "bake/journal/shard_set.h"

#include <algorithm>

#include <fmt/format.h>

#include "bake/journal/trace_journal.h"

namespace clamor {

namespace {

Result<ShardNote> note_of(const std::string& path) {
  const auto summary = JournalSummary::of(path);
  if (!summary.ok()) return summary.error();
  if (!summary->note)
    return Error(path +
                 ": is not a shard, or its bake was stopped before it began; make it with 'clamor "
                 "bake --shard I/N'");
  const ShardNote& note = *summary->note;
  if (note.program != shard_program())
    return Error(path + ": was made by " + note.program + ", but this is " + shard_program() +
                 "; trace it again with this version, or merge with that one");
  if (!note.is_complete)
    return Error(fmt::format(
        "{}: {} before its end, so photons of it are in none of the shards; {}", path,
        summary->is_being_written ? "is still being traced and not" : "was stopped or cut short",
        summary->is_being_written ? "wait for it" : "run its command again, which continues it"));
  return note;
}

}  // namespace

Result<ShardNote> note_of_shards(const std::vector<std::string>& paths) {
  ShardNote together;
  for (const std::string& path : paths) {
    const auto note = note_of(path);
    if (!note.ok()) return note.error();
    if (path == paths.front()) {
      together = *note;
      continue;
    }
    if (note->options() != together.options())
      return Error(path + ": was made with other options than " + paths.front() +
                   "; the shards of one bake may differ only in --shard and -o");
    if (note->count != together.count)
      return Error(
          fmt::format("{}: is of {} shards, but {} is of {}; make all with the same N of "
                      "'--shard I/N'",
                      path, note->count, paths.front(), together.count));
    together.shards.insert(together.shards.end(), note->shards.begin(), note->shards.end());
  }
  std::sort(together.shards.begin(), together.shards.end());
  together.shards.erase(std::unique(together.shards.begin(), together.shards.end()),
                        together.shards.end());
  return together;
}

Result<void> check_all_there(const ShardNote& together) {
  std::vector<std::uint32_t> missing;
  for (std::uint32_t shard = 0, at = 0; shard < together.count; ++shard)
    if (at < together.shards.size() && together.shards[at] == shard)
      ++at;
    else
      missing.push_back(shard);
  if (missing.empty()) return {};
  return Error(
      fmt::format("{} of {} {} in none of the shards that were given; trace {}, or name "
                  "the missing files",
                  ranges_of(missing), together.count, missing.size() == 1 ? "is" : "are",
                  missing.size() == 1 ? "it" : "them"));
}

Result<void> check_level_hash(const std::vector<std::string>& paths, std::uint64_t level_hash,
                              const std::string& level_path) {
  for (const std::string& path : paths) {
    const auto summary = JournalSummary::of(path);
    if (!summary.ok()) return summary.error();
    if (summary->note && summary->note->level_hash != level_hash)
      return Error(fmt::format(
          "{}: is stale: it was traced from a level with the content hash {:016x}, but that of {} "
          "and its files is {:016x}; trace it again, or restore the level",
          path, summary->note->level_hash, level_path, level_hash));
  }
  return {};
}

}  // namespace clamor
