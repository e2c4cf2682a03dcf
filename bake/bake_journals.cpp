#include "bake/bake_journals.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bake/journal/trace_journal.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

// Opens a shard and checks all of it.
Result<TraceJournal> open_shard(const std::string& path, std::size_t materials,
                                std::size_t portals) {
  auto opened = TraceJournal::open_to_read(path, materials, portals);
  if (!opened.ok()) return opened.error();
  const std::string then =
      ", so photons of it are in none of the shards; run its command again, which traces what is "
      "missing";
  if (opened->cut_bytes() > 0)
    return Error(path + ": is cut short in the middle of a record" + then);
  if (opened->damaged() > 0)
    return Error(path + ": " + std::to_string(opened->damaged()) +
                 " of its records fail their checksum" + then);
  return opened;
}

}  // namespace

Result<OpenJournals> open_journals(std::size_t materials, std::size_t portals,
                                   const BakeOptions& options) {
  OpenJournals journals;
  journals.writes = !options.journal.empty();
  journals.has_all = !options.shards.empty();
  if (journals.writes) {
    auto opened = TraceJournal::open(options.journal, materials, portals);
    if (!opened.ok()) return opened.error();
    if (options.tells_progress) opened->tell_progress();
    // A complete shard stays the same bytes when its command is run again.
    if (options.note && opened->note() != options.note->completed().text())
      if (const auto noted = opened->set_note(options.note->text()); !noted.ok())
        return noted.error();
    journals.list.push_back(std::move(*opened));
  }
  std::vector<std::optional<Result<TraceJournal>>> shards(options.shards.size());
  team_for(0, shards.size(), [&](std::size_t i) {
    if (!options.is_stopped()) shards[i].emplace(open_shard(options.shards[i], materials, portals));
  });
  for (auto& shard : shards) {
    if (!shard) break;
    if (!shard->ok()) return shard->error();
    journals.list.push_back(std::move(**shard));
  }
  return journals;
}

}  // namespace clamor
