#include "bake/journal/shard_note.h"

#include <algorithm>
#include <charconv>
#include <locale>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "bake/journal/run_key.h"
#include "common/version.h"

namespace clamor {

namespace {

constexpr std::string_view kProgressTag = "progress ";

// A number up to `end_letter`, which is removed with it.
std::optional<std::uint64_t> number_up_to(std::string_view& text, char end_letter, int base = 10) {
  std::uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, wrong] = std::from_chars(text.data(), end, number, base);
  if (wrong != std::errc() || rest == end || *rest != end_letter) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(rest - text.data()) + 1);
  return number;
}

std::optional<std::vector<std::uint32_t>> shards_of(std::string_view ranges, std::uint32_t count) {
  std::vector<std::uint32_t> shards;
  while (!ranges.empty()) {
    const std::size_t end = std::min(ranges.find(','), ranges.size());
    std::string one(ranges.substr(0, end));
    ranges.remove_prefix(std::min(end + 1, ranges.size()));
    std::string_view rest = one += ';';
    const auto alone = number_up_to(rest, ';');
    const auto first = alone ? alone : number_up_to(rest, '-');
    const auto last = alone ? alone : number_up_to(rest, ';');
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

std::optional<ShardNote> ShardNote::from(const std::string& text) {
  ShardNote note;
  std::string_view left = text;
  const auto line = [&left]() -> std::optional<std::string> {
    const std::size_t end = left.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    std::string found(left.substr(0, end));
    left.remove_prefix(end + 1);
    return found;
  };
  const auto program = line();
  const auto hash = number_up_to(left, '\n', 16);
  const auto part = line(), state = line();
  if (!program || !hash || !part || !state || (*state != "complete" && *state != "begun"))
    return std::nullopt;
  const std::size_t slash = part->find('/');
  if (slash == std::string::npos) return std::nullopt;
  std::string after = part->substr(slash + 1) + ";";
  std::string_view count_text = after;
  const auto count = number_up_to(count_text, ';');
  if (!count || *count == 0 || *count > kMaxShards) return std::nullopt;
  note.count = static_cast<std::uint32_t>(*count);
  const auto shards = shards_of(std::string_view(*part).substr(0, slash), note.count);
  if (!shards) return std::nullopt;
  note.program = *program;
  note.level_hash = *hash;
  note.shards = *shards;
  note.is_complete = *state == "complete";
  note.request = std::string(left);
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

}  // namespace clamor
