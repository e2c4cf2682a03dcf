#include "tools/farm/farm_plan.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <span>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "bake/bake_plan.h"
#include "bake/trace/photon_tracer.h"
#include "common/utf8_path.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/files/atomic_file.h"
#include "formats/files/json.h"
#include "tools/program/shell_quote.h"

namespace clamor {

namespace {

std::string joined_for_shell(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : " ") + shell_quoted(word);
  return line;
}

std::string in_hex(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

std::string megabytes_up(std::uint64_t bytes) {
  return std::to_string((bytes + 999'999) / 1'000'000) + "MB";
}

template <class... F>
struct Overloads : F... {
  using F::operator()...;
};
template <class... F>
Overloads(F...) -> Overloads<F...>;

// Calls visit(key, value) for each text, list of words and hash of farm.json, and visit(key, value,
// most) for each number, in the order of the file.
template <class Plan, class Visit>
void for_each_field(Plan& plan, const Visit& visit) {
  constexpr double kMost = 1e15;
  visit("made_by", plan.made_by);
  visit("program", plan.program);
  visit("folder", plan.folder);
  visit("level", plan.level);
  visit("output", plan.output);
  visit("level_hash", plan.level_hash);
  visit("options", plan.options);
  visit("shards", plan.shards, kMaxShards);
  visit("merged_at_once", plan.merged_at_once, kMaxShards);
  visit("threads", plan.threads, 1024);
  visit("memory_bytes", plan.memory_bytes, kMost);
  visit("until_db", plan.goal_db, 1e6);
  visit("round", plan.rounds.round, 1000);
  visit("times", plan.rounds.times, kMost);
  visit("first_photons", plan.rounds.first_photons, kMost);
  visit("first_sources", plan.rounds.first_sources, kMost);
  visit("photons", plan.photons, kMost);
  visit("shard_s", plan.shard_s, kMost);
  visit("preparing_s", plan.preparing_s, kMost);
  visit("shard_memory_bytes", plan.shard_memory_bytes, kMost);
  visit("merge_memory_bytes", plan.merge_memory_bytes, kMost);
}

// The options of the shards of this round, in the form of their notes.
std::string note_options(const FarmPlan& plan) {
  std::string options;
  for (const std::string& word : plan.words()) options += '\0' + word;
  return options;
}

}  // namespace

std::string FarmPlan::folder_of(const std::string& output) { return output + ".farm"; }

Result<FarmPlan> FarmPlan::load(const std::string& output) {
  std::error_code ignored;
  const std::string path =
      folder_of(std::filesystem::absolute(path_of(output), ignored).string()) + "/farm.json";
  if (!std::filesystem::exists(path_of(path), ignored))
    return Error(path + ": is not there; plan a farm with: clamor farm LEVEL -o " +
                 shell_quoted(output) + " --shards N");
  const auto json = read_json(path);
  if (!json.ok()) return json.error();
  JsonFields fields(*json, path);
  FarmPlan plan;
  for_each_field(
      plan,
      Overloads{[&](const char* key, std::string& text) { text = fields.string(key).value_or(""); },
                [&](const char* key, std::vector<std::string>& words) {
                  if (const Json* list = fields.any(key); list != nullptr && list->array())
                    for (const Json& word : *list->array())
                      if (word.string()) words.push_back(*word.string());
                },
                [&](const char* key, auto& number, double most) {
                  number = static_cast<std::remove_reference_t<decltype(number)>>(
                      fields.number(key, 0, most).value_or(0));
                },
                [&](const char* key, std::uint64_t& hash) {
                  const std::string digits = fields.string(key).value_or("");
                  std::from_chars(digits.data(), digits.data() + digits.size(), hash, 16);
                }});
  if (const auto right = fields.result(); !right.ok()) return right.error();
  if (plan.shards == 0 || plan.threads == 0 || plan.rounds.times == 0 || plan.level.empty() ||
      plan.output.empty())
    return Error(path + ": is no plan of a farm; remove it and plan the farm again");
  return plan;
}

Result<void> FarmPlan::save() const {
  std::error_code ignored;  // creating the file reports it
  std::filesystem::create_directories(folder_of(output), ignored);
  Json::Object plan;
  for_each_field(*this, Overloads{[&](const char* key, const std::string& text) {
                                    plan.emplace_back(key, Json(text));
                                  },
                                  [&](const char* key, const std::vector<std::string>& words) {
                                    plan.emplace_back(
                                        key, Json(Json::Array(words.begin(), words.end())));
                                  },
                                  [&](const char* key, auto number, double) {
                                    plan.emplace_back(key, Json(static_cast<double>(number)));
                                  },
                                  [&](const char* key, std::uint64_t hash) {
                                    plan.emplace_back(key, Json(in_hex(hash)));
                                  }});
  return write_file(folder_of(output) + "/farm.json", dump_json(Json(std::move(plan))) + "\n");
}

void FarmPlan::go_to(const BakeRounds& later) {
  const std::uint64_t before = photons;
  const double growth = static_cast<double>(later.times) / static_cast<double>(rounds.times);
  photons = photons / rounds.times * later.times;
  shard_s = preparing_s + (shard_s - preparing_s) * growth;
  const std::uint64_t of_runs = kBytesPerRun * ((photons - before) / kRunPhotons + 1);
  shard_memory_bytes += of_runs;
  merge_memory_bytes +=
      of_runs + kBytesPerSource * (later.times - rounds.times) * rounds.first_sources;
  rounds = later;
}

bool FarmPlan::is_same_bake(const FarmPlan& other) const {
  return made_by == other.made_by && level_hash == other.level_hash && options == other.options &&
         shards == other.shards && goal_db == other.goal_db;
}

std::string FarmPlan::file_of_shard(std::uint32_t shard) const {
  return fmt::format("{}/{}.shard", folder_of(output), shard + 1);
}

std::uint32_t FarmPlan::groups() const {
  return shards <= merged_at_once
             ? 0
             : static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(shards))));
}

std::vector<std::uint32_t> FarmPlan::shards_of_group(std::uint32_t group) const {
  std::vector<std::uint32_t> members;
  const std::uint64_t first = std::uint64_t{group} * shards / groups();
  const std::uint64_t end = (std::uint64_t{group} + 1) * shards / groups();
  for (std::uint64_t shard = first; shard < end; ++shard)
    members.push_back(static_cast<std::uint32_t>(shard));
  return members;
}

std::string FarmPlan::file_of_group(std::uint32_t group) const {
  return fmt::format("{}/group.{}.shard", folder_of(output), group + 1);
}

bool FarmPlan::names_files() const {
  return std::any_of(options.begin(), options.end(), [](const std::string& word) {
    return word == "--emitter" || word == "--acoustics";
  });
}

std::vector<std::string> FarmPlan::words() const {
  if (goal_db == 0) return options;
  // In the order of BakeRequest::words(), as a bake on one machine names them.
  std::vector<std::string> all = options;
  auto place = std::find_if(all.begin(), all.end(), [](const std::string& word) {
    return word == "--probes" || word == "--probe-sources" || word == "--seed" ||
           word == "--simplify" || word == "--instances" || word == "--early-order" ||
           word == "--kappa" || word == "--longest";
  });
  all.insert(place, {"--photons", std::to_string(rounds.times * rounds.first_photons), "--sources",
                     std::to_string(rounds.times * rounds.first_sources)});
  return all;
}

std::string FarmPlan::shard_command(std::uint32_t shard) const {
  std::vector<std::string> line;
  if (names_files()) line = {"env", "-C", folder};
  line.insert(line.end(), {program, "bake", level, "-o", file_of_shard(shard), "--shard",
                           fmt::format("{}/{}", shard + 1, shards)});
  const auto bake_words = words();
  line.insert(line.end(), bake_words.begin(), bake_words.end());
  line.insert(line.end(),
              {"--level-hash", in_hex(level_hash), "--threads", std::to_string(threads), "--memory",
               megabytes_up(shard_memory_bytes), "--expected-time",
               fmt::format("{:.0f}s", std::ceil(shard_s)), "--progress", "journal", "--quiet"});
  return joined_for_shell(line);
}

std::vector<std::string> FarmPlan::words_of_group(std::uint32_t group) const {
  std::vector<std::string> all;
  for (const std::uint32_t shard : shards_of_group(group)) all.push_back(file_of_shard(shard));
  all.insert(all.end(), {"-o", file_of_group(group), "--to-shard", "--quiet"});
  return all;
}

std::string FarmPlan::group_command(std::uint32_t group) const {
  std::vector<std::string> line{program, "merge"};
  const auto group_words = words_of_group(group);
  line.insert(line.end(), group_words.begin(), group_words.end());
  return joined_for_shell(line);
}

std::string FarmPlan::merge_command() const {
  std::vector<std::string> line;
  if (names_files()) line = {"env", "-C", folder};
  line.insert(line.end(), {program, "farm", "merge", output});
  return joined_for_shell(line);
}

std::string FarmPlan::resume_command() const {
  return "clamor farm resume " + shell_quoted(output);
}

std::string FarmPlan::short_hash() const {
  const std::string all = output + in_hex(level_hash) + joined_for_shell(options);
  return in_hex(hash_of(std::as_bytes(std::span(all)))).substr(0, 8);
}

const char* name_of(ShardState::Is is) {
  constexpr const char* kNames[] = {"waiting", "running", "lost", "done", "wrong"};
  return kNames[static_cast<std::size_t>(is)];
}

ShardState state_of_shard(const FarmPlan& plan, std::uint32_t shard, bool checks_all) {
  using Is = ShardState::Is;
  ShardState state;
  const std::string path = plan.file_of_shard(shard);
  std::error_code ignored;
  if (!std::filesystem::exists(path_of(path), ignored)) return state;
  const auto wrong = [&state](const std::string& why) {
    state.is = Is::kWrong;
    state.problem = why;
    return state;
  };
  const auto summary = JournalSummary::of(path);
  if (!summary.ok()) return wrong(summary.error().message);
  state.bytes = summary->bytes;
  const auto& note = summary->note;
  if (note && note->program != plan.made_by)
    return wrong(path + ": was made by " + note->program + ", the farm by " + plan.made_by);
  if (note && note->level_hash != plan.level_hash)
    return wrong(path + ": is stale, traced from a level with the content hash " +
                 in_hex(note->level_hash));
  if (note && (note->count != plan.shards || note->shards != std::vector{shard}))
    return wrong(fmt::format("{}: is shard {} of {}, where shard {} of {} is expected", path,
                             ranges_of(note->shards), note->count, shard + 1, plan.shards));
  const bool is_of_round = note && note->options() == note_options(plan);
  if (note && !is_of_round && plan.goal_db == 0)
    return wrong(path + ": was made with other options than the farm's");
  if (is_of_round) state.progress = summary->progress;
  state.is = summary->is_being_written ? Is::kRunning
             : !is_of_round            ? Is::kWaiting
             : !note->is_complete      ? Is::kLost
                                       : Is::kDone;
  if (state.is != Is::kDone) return state;
  if (summary->cut_bytes > 0) return wrong(path + ": is cut short");
  if (checks_all)
    if (const auto whole = check_records(path); !whole.ok()) return wrong(whole.error().message);
  return state;
}

bool is_group_done(const FarmPlan& plan, std::uint32_t group) {
  std::error_code ignored;
  const std::string path = plan.file_of_group(group);
  if (!std::filesystem::exists(path_of(path), ignored)) return false;
  const auto summary = JournalSummary::of(path);
  return summary.ok() && summary->note && summary->note->is_complete && summary->cut_bytes == 0 &&
         summary->note->program == plan.made_by && summary->note->level_hash == plan.level_hash &&
         summary->note->count == plan.shards &&
         summary->note->shards == plan.shards_of_group(group) &&
         summary->note->options() == note_options(plan) && check_records(path).ok();
}

bool is_merged(const FarmPlan& plan) {
  std::error_code ignored;
  if (!std::filesystem::exists(path_of(plan.output), ignored)) return false;
  const auto file = BakeFile::open(plan.output);
  return file.ok() && file->provenance().input_hash == plan.level_hash &&
         file->provenance().arguments == plan.words();
}

}  // namespace clamor
