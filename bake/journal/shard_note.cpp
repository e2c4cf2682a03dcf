#include "bake/journal/shard_note.h"

#include <algorithm>
#include <charconv>
#include <locale>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "bake/journal/run_key.h"
#include "bake/journal/trace_journal.h"
#include "common/version.h"

namespace clamor {

namespace {

constexpr std::string_view kProgressTag = "progress ";

// The number that the whole text is.
std::optional<std::uint64_t> number_of(std::string_view text, int base = 10) {
  std::uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, wrong] = std::from_chars(text.data(), end, number, base);
  return wrong == std::errc() && rest == end ? std::optional(number) : std::nullopt;
}

std::optional<std::vector<std::uint32_t>> shards_of(const std::string& ranges,
                                                    std::uint32_t count) {
  std::vector<std::uint32_t> shards;
  std::istringstream parts(ranges);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t dash = part.find('-');
    const auto first = number_of(part.substr(0, dash));
    const auto last = dash == std::string::npos ? first : number_of(part.substr(dash + 1));
    if (!first || !last || *first == 0 || *first > *last || *last > count ||
        (!shards.empty() && *first <= shards.back() + 1u))
      return std::nullopt;
    for (std::uint64_t shard = *first; shard <= *last; ++shard)
      shards.push_back(static_cast<std::uint32_t>(shard - 1));
  }
  if (shards.empty()) return std::nullopt;
  return shards;
}

}  // namespace

std::string shard_program() { return std::string("clamor ") + kVersion + "/" + trace_version(); }

std::string ranges_of(const std::vector<std::uint32_t>& ascending) {
  std::string text;
  for (std::size_t first = 0, end = 0; first < ascending.size(); first = end) {
    end = first + 1;
    while (end < ascending.size() && ascending[end] == ascending[end - 1] + 1) ++end;
    text += (text.empty() ? "" : ",") + std::to_string(ascending[first] + 1);
    if (end - first > 1) text += "-" + std::to_string(ascending[end - 1] + 1);
  }
  return text;
}

std::string ShardNote::text() const {
  return fmt::format("{}\n{:016x}\n{}/{}\n{}\n{}", program, level_hash, ranges_of(shards), count,
                     is_complete ? "complete" : "begun", request);
}

ShardNote ShardNote::completed() const {
  ShardNote note = *this;
  note.is_complete = true;
  return note;
}

std::optional<ShardNote> ShardNote::from(const std::string& text) {
  ShardNote note;
  std::istringstream lines(text);
  std::string hash_text, part, state;
  for (std::string* const line : {&note.program, &hash_text, &part, &state})
    if (!std::getline(lines, *line) || lines.eof()) return std::nullopt;
  const auto hash = number_of(hash_text, 16);
  const std::size_t slash = part.find('/');
  if (!hash || (state != "complete" && state != "begun") || slash == std::string::npos)
    return std::nullopt;
  const auto count = number_of(part.substr(slash + 1));
  if (!count || *count == 0 || *count > kMaxShards) return std::nullopt;
  note.count = static_cast<std::uint32_t>(*count);
  auto shards = shards_of(part.substr(0, slash), note.count);
  if (!shards) return std::nullopt;
  note.shards = std::move(*shards);
  note.level_hash = *hash;
  note.is_complete = state == "complete";
  note.request = text.substr(static_cast<std::size_t>(lines.tellg()));
  return note;
}

std::string ShardNote::options() const {
  const std::size_t end = request.find('\0');
  return end == std::string::npos ? "" : request.substr(end);
}

std::string ShardProgress::text() const {
  return fmt::format("{}{} {} {:.3f} {:.3f} {:.3f} {} {}", kProgressTag, photons, traced, seconds,
                     before_s, core_s, error_db ? fmt::format("{:.4f}", *error_db) : "unknown",
                     host);
}

std::optional<ShardProgress> ShardProgress::from(const std::string& text) {
  if (!text.starts_with(kProgressTag)) return std::nullopt;
  std::istringstream words(text.substr(kProgressTag.size()));
  words.imbue(std::locale::classic());
  ShardProgress progress;
  std::string error;
  if (!(words >> progress.photons >> progress.traced >> progress.seconds >> progress.before_s >>
        progress.core_s >> error >> progress.host))
    return std::nullopt;
  if (error != "unknown") {
    double error_db = 0;
    const char* const end = error.data() + error.size();
    if (std::from_chars(error.data(), end, error_db).ptr != end) return std::nullopt;
    progress.error_db = error_db;
  }
  return progress;
}

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
