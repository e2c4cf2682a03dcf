// farm_command.cpp: clamor farm: shares a bake out among machines, on schedulers that are there.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>
#include <ostream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/journal/shard_note.h"
#include "bake/level_bake.h"
#include "common/utf8_path.h"
#include "formats/bake_file/bake_file.h"
#include "formats/files/output_target.h"
#include "formats/gltf/import_report.h"
#include "tools/commands/bake_arguments.h"
#include "tools/commands/commands.h"
#include "tools/farm/farm_plan.h"
#include "tools/farm/farm_schedulers.h"
#include "tools/farm/farm_status.h"
#include "tools/program/arguments.h"
#include "tools/program/interrupt.h"
#include "tools/program/output_ending.h"
#include "tools/program/shell_quote.h"
#include "tools/program/stage_notice.h"
#include "tools/program/terminal_output.h"

namespace clamor {

namespace {

int end_farm(std::ostream& err, const Result<void>& done) {
  if (done.ok()) return kSuccess;
  print_error(err, "farm", done.error().message);
  return kBadInput;
}

// Where the work goes: to standard output, to Slurm or to processes of this machine.
struct FarmScheduler {
  bool slurm = false, quiet = false;
  int local = 0;

  void add_options(Arguments& parser) {
    parser.flag("--slurm", slurm,
                "submit a job array and the merge after it with sbatch, and print the ids; "
                "SBATCH_PARTITION and its like choose where");
    parser.option("--local", local, {0, 1024}, "run this many shards at a time on this machine");
    parser.flag("--quiet", quiet, "print only warnings and errors");
  }
};

// Loads a plan that this version can carry out: the shards of another would be wrong in its eyes.
Result<FarmPlan> load_own_plan(const std::string& output) {
  auto plan = FarmPlan::load(output);
  if (plan.ok() && plan->made_by != shard_program())
    return Error(FarmPlan::folder_of(plan->output) + ": was planned by " + plan->made_by +
                 ", and this is " + shard_program() +
                 "; take that version to the end, or remove the folder and plan the farm again");
  return plan;
}

// Runs rounds until the output is there.
Result<void> run_all_here(const std::string& output, const FarmScheduler& scheduler,
                          std::ostream& err) {
  for (int last_round = 0;;) {
    const auto plan = load_own_plan(output);
    if (!plan.ok()) return plan.error();
    const FarmWork work = work_left(*plan);
    if (work.is_empty()) return {};
    if (std::exchange(last_round, plan->rounds.round) == plan->rounds.round)
      return Error(plan->output + ": is not made, though all commands ended without an error (" +
                   (work.problems.empty() ? "nothing was traced" : work.problems.front()) +
                   "); check --program " + shell_quoted(plan->program));
    if (work.waits && work.shards.empty())
      return Error(plan->output + ": its last shards are still running; wait for them");
    for (const std::string& problem : work.problems) fmt::print(err, "  again    {}\n", problem);
    const auto run = [&](const std::string& kind, const std::vector<FarmJob>& jobs) {
      return run_here(*plan, kind, jobs, scheduler.local, scheduler.quiet, err);
    };
    if (auto traced = run("shard", work.shards); !traced.ok()) return traced;
    if (auto joined = run("group", work.groups); !joined.ok()) return joined;
    if (auto merged = run("merge", {{1, plan->merge_command()}}); !merged.ok()) return merged;
  }
}

// Hands out what is left to do: as lines to be run in any order, or in order to the end.
enum class Lines { kInAnyOrder, kInOrder };

Result<void> schedule(const std::string& output, const FarmScheduler& scheduler, Lines lines,
                      std::ostream& out, std::ostream& err) {
  if (scheduler.local > 0) return run_all_here(output, scheduler, err);
  const auto plan = load_own_plan(output);
  if (!plan.ok()) return plan.error();
  const FarmWork work = work_left(*plan);
  for (const std::string& problem : work.problems) fmt::print(err, "  again    {}\n", problem);
  if (scheduler.slurm) return submit_to_slurm(*plan, work, out);
  const bool all_traced = work.shards.empty();
  if (all_traced && work.waits) {
    if (!scheduler.quiet) fmt::print(err, "  waiting  the last shards are still running\n");
    return {};
  }
  const bool to_the_end = lines == Lines::kInOrder && !work.waits;
  for (const FarmJob& job : work.shards) fmt::print(out, "{}\n", job.command);
  if (all_traced || to_the_end) {
    for (const FarmJob& job : work.groups) fmt::print(out, "{}\n", job.command);
    if (work.merges && (work.groups.empty() || to_the_end))
      fmt::print(out, "{}\n", plan->merge_command());
  } else if (!scheduler.quiet) {
    fmt::print(err, "  then     {}   prints what is left: failed shards, and the merge\n",
               printable(plan->resume_command()));
  }
  return {};
}

// Tells only the warnings of the level, and stages that take long.
class FarmPrinter final : public BakeObserver {
 public:
  explicit FarmPrinter(std::ostream& err) : err_(err) {}
  void on_stage(const std::string& stage) override { notice_.begin(stage); }
  void on_warning(const std::string& text) override {
    const auto held = notice_.hold();
    print_listed_warning(err_, text);
  }

 private:
  std::ostream& err_;
  StageNotice notice_{err_};
};

struct FarmWords {
  BakeRequest request;
  FarmPlan plan;
  std::optional<std::string> until;
  BakeGoal goal;
  FarmScheduler scheduler;
};

std::string absolute_path(const std::string& path) {
  return std::filesystem::absolute(path_of(path)).lexically_normal().string();
}

// Completes a plan whose words are known.
Result<FarmPlan> make_plan(const FarmWords& words, std::ostream& err) {
  FarmPlan plan = words.plan;
  const auto target = OutputTarget::find(plan.output);
  if (!target.ok()) return target.error();
  if (target->is_stream())
    return Error(
        plan.output +
        ": machines share the folder beside the output; name a file, not a device or pipe");
  BakeRequest request = words.request;
  plan.folder = std::filesystem::current_path().string();
  std::vector<std::string> in_lines = request.words();
  in_lines.insert(in_lines.end(), {absolute_path(request.level_path), absolute_path(plan.output),
                                   plan.program, plan.folder});
  for (const std::string& word : in_lines)
    if (word.find('\n') != std::string::npos)
      return Error(in_quotes(word) +
                   ": holds a line break, and a farm is one command a line; rename it");
  if (request.level_path.empty()) return Error("the level's name is empty; name a file to read");
  request.level_path = absolute_path(request.level_path);
  LevelBakeOptions options;
  options.output = absolute_path(plan.output);
  options.journal = "";
  options.reports_progress = false;
  if (words.goal.error_db > 0) options.goal = words.goal;
  FarmPrinter printer(err);
  LevelBake bake(request, options, printer);
  const auto start = std::chrono::steady_clock::now();
  if (auto read = bake.read(); !read.ok()) return read.error();
  if (auto prepared = bake.prepare(); !prepared.ok()) return prepared.error();
  const double read_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto cost = bake.cost();
  if (!cost.ok()) return cost.error();

  plan.made_by = shard_program();
  if (plan.program.find('/') != std::string::npos) plan.program = absolute_path(plan.program);
  if (plan.program.empty()) {
    std::error_code unknown;
    plan.program = std::filesystem::read_symlink("/proc/self/exe", unknown).string();
    if (unknown) plan.program = "clamor";
  }
  plan.level = request.level_path;
  plan.output = options.output;
  plan.level_hash = bake.level_hash();
  plan.options = request.words();
  plan.goal_db = words.goal.error_db;
  plan.rounds.first_photons = cost->settings.photons;
  plan.rounds.first_sources = cost->settings.sources;
  plan.photons = cost->photons;
  plan.preparing_s = read_s + cost->preparing_s;
  plan.shard_s = plan.preparing_s;
  // At least one batch of photons goes to the largest shard, whatever their number.
  const double of_shard = std::ceil(static_cast<double>(cost->photons) / 1024 / plan.shards) * 1024;
  if (cost->photons_per_core_s > 0)
    plan.shard_s += std::min(of_shard, static_cast<double>(cost->photons)) /
                    cost->photons_per_core_s / plan.threads;
  plan.shard_memory_bytes =
      cost->shard_memory_bytes +
      cost->thread_memory_bytes * static_cast<std::uint64_t>(plan.threads - 1);
  plan.merge_memory_bytes = cost->merge_memory_bytes;
  if (!words.scheduler.quiet)
    fmt::print(err,
               "  plan     {} triangles, {} photons in {} shards, {:.0f} per core and second; each "
               "shard about "
               "{:.1f} s ({:.1f} s of it before the first photon), {} MB of memory, {:.1f} MB of "
               "disk\n",
               cost->triangles, cost->photons, plan.shards, cost->photons_per_core_s, plan.shard_s,
               plan.preparing_s, plan.shard_memory_bytes / 1'000'000,
               cost->bytes_per_photon * of_shard / 1e6);
  return plan;
}

// Saves the plan, unless the folder has it already, in a later round.
Result<void> keep_plan(const FarmPlan& plan) {
  std::error_code ignored;
  if (!std::filesystem::exists(FarmPlan::folder_of(plan.output) + "/farm.json", ignored))
    return plan.save();
  const auto there = FarmPlan::load(plan.output);
  if (!there.ok()) return there.error();
  if (!there->is_same_bake(plan))
    return Error(FarmPlan::folder_of(plan.output) +
                 ": holds another farm, of another level, version, other options or another number "
                 "of shards; choose another output, or remove the folder");
  FarmPlan renewed = plan;
  renewed.go_to(there->rounds);
  return renewed.save();
}

int run_farm_status(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string output;
  bool json = false;
  Arguments parser(
      "farm status",
      "Reads from the shards' journals how far a farm is: which shards are done, "
      "running, lost (begun, but no process writes them any more) or waiting, the rate, "
      "the time left and the error of the energy decay so far.",
      "clamor farm status hall.clamor");
  parser.positional("output", output, "the output of the farm, as in hall.clamor");
  parser.flag("--json", json, "print JSON");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto plan = FarmPlan::load(output);
  if (!plan.ok()) return parser.end(err, plan.error());
  const FarmStatus status = status_of(*plan);
  if (json)
    out << status_json(*plan, status);
  else
    print_status(*plan, status, out);
  return kSuccess;
}

int run_farm_resume(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string output;
  FarmScheduler scheduler;
  Arguments parser("farm resume",
                   "Prints, in the order in which they are to be run, or runs or submits what a "
                   "farm still lacks: shards that are lost, damaged or were never begun, and the "
                   "merge. While other shards are running, the merge is left out. Prints nothing "
                   "when all is done.",
                   "clamor farm resume hall.clamor | sh");
  parser.positional("output", output, "the output of the farm, as in hall.clamor");
  scheduler.add_options(parser);
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  return end_farm(err, schedule(output, scheduler, Lines::kInOrder, out, err));
}

// Plans the next round of a farm with a goal, if the merged file is not good enough.
Result<void> plan_next_round(FarmPlan plan, std::ostream& err) {
  const auto file = BakeFile::open(plan.output);
  if (!file.ok()) return file.error();
  const auto error_db = static_cast<double>(file->statistics().decay.error_db);
  BakeRounds next = plan.rounds;
  std::string reason;
  if (file->statistics().photons_traced == 0) return {};
  if (!next.go_on(error_db, plan.goal_db, reason)) {
    if (!reason.empty()) print_listed_warning(err, "--until was not reached: " + reason);
    return {};
  }
  fmt::print(
      err,
      "  round    {} is planned, {:g} times as large, because {:.2f} dB are known of {:g} dB: "
      "{}\n",
      next.round, static_cast<double>(next.times) / static_cast<double>(plan.rounds.times),
      error_db, plan.goal_db, printable(plan.resume_command()));
  plan.go_to(next);
  return plan.save();
}

// Whether no shard of this round has begun.
bool is_untouched(const FarmPlan& plan) {
  for (std::uint32_t shard = 0; shard < plan.shards; ++shard)
    if (state_of_shard(plan, shard, false).is != ShardState::Is::kWaiting) return false;
  return true;
}

// During its lifetime, relative paths start from another folder.
class InFolder {
 public:
  explicit InFolder(const std::string& folder) : before_(std::filesystem::current_path(ignored_)) {
    std::filesystem::current_path(path_of(folder),
                                  ignored_);  // a file that is missing is an error later
  }
  ~InFolder() { std::filesystem::current_path(before_, ignored_); }
  InFolder(const InFolder&) = delete;
  InFolder& operator=(const InFolder&) = delete;

 private:
  std::error_code ignored_;
  std::filesystem::path before_;
};

int run_farm_merge(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string output;
  Arguments parser("farm merge",
                   "Merges the shards of a farm into its output, and with --until plans the next "
                   "round. 'clamor farm resume' prints this command when all shards are there.",
                   "clamor farm merge hall.clamor");
  parser.positional("output", output, "the output of the farm, as in hall.clamor");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto plan = load_own_plan(output);
  if (!plan.ok()) return parser.end(err, plan.error());
  std::optional<InFolder> in_folder;
  if (plan->names_files()) in_folder.emplace(plan->folder);
  // A scheduler that runs a merge again must not plan the round after the next.
  if (plan->rounds.round > 1 && is_untouched(*plan)) {
    fmt::print(err, "  round    {} is planned, and nothing of it is traced: {}\n",
               plan->rounds.round, printable(plan->resume_command()));
    return kSuccess;
  }
  std::vector<std::string> words;
  for (std::uint32_t group = 0; group < plan->groups(); ++group) {
    if (!is_group_done(*plan, group))
      if (const int code = run_merge(plan->words_of_group(group), out, err); code != kSuccess)
        return code;
    words.push_back(plan->file_of_group(group));
  }
  for (std::uint32_t shard = 0; shard < plan->shards && plan->groups() == 0; ++shard)
    words.push_back(plan->file_of_shard(shard));
  words.insert(words.end(), {"-o", plan->output, "--level", plan->level, "--quiet"});
  if (plan->memory_bytes > 0)
    words.insert(words.end(),
                 {"--memory",
                  fmt::format("{}MB", std::max<std::uint64_t>(1, plan->memory_bytes / 1'000'000))});
  if (const int code = run_merge(words, out, err); code != kSuccess) return code;
  return plan->goal_db == 0 ? kSuccess : parser.end(err, plan_next_round(*plan, err));
}

// Checks the words, and reads the goal. The Error is bad usage.
Result<void> interpret(FarmWords& words) {
  if (const auto complaint = words.request.complaint()) return Error(*complaint);
  if (words.scheduler.slurm && words.scheduler.local > 0)
    return Error("give either --slurm or --local, not both");
  if (!words.until) return {};
  const auto wanted = BakeGoal::from(*words.until);
  if (!wanted || wanted->error_db == 0)
    return Error("--until " + in_quotes(*words.until) +
                 " is no error like 0.5dB; a farm has no limit of time");
  if (words.request.photons || words.request.sources)
    return Error(
        "--until sets the number of photons and sources, so it cannot be combined with --photons "
        "or --sources");
  words.goal = *wanted;
  return {};
}

int run_farm_plan(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  FarmWords words;
  FarmPlan& plan = words.plan;
  plan.shards = 0;  // to be given
  Arguments parser(
      "farm",
      "Shares a bake out among machines that see the same folders. Prints one command a line, each "
      "of which traces a shard into OUTPUT.farm on whatever machine and in whatever order, for "
      "xargs, GNU parallel, OpenCue or Flamenco; or submits them to Slurm; or runs them here. The "
      "output has the same bytes as a bake on one machine.\n"
      "  clamor farm status OUTPUT [--json]   how far it is\n"
      "  clamor farm resume OUTPUT            what is left to do: lost shards, and the merge\n"
      "  clamor farm merge OUTPUT             merges, as the last line of resume does",
      "clamor farm hall.glb -o hall.clamor --shards 64 | xargs -d '\\n' -n 1 -P 8 sh -c && clamor "
      "farm resume hall.clamor | sh");
  parser.positional("level", words.request.level_path, "the level, a .gltf or .glb file");
  parser.option("-o,--output", plan.output, "the bake file to write, as in hall.clamor");
  parser.required("-o");
  parser.option("--shards", plan.shards, {1, static_cast<int>(kMaxShards)},
                "number of shards; four for each process keep all busy to the end");
  parser.required("--shards");
  words.scheduler.add_options(parser);
  parser.option("--threads", plan.threads, {1, 1024}, "threads of each shard");
  parser.option("--merge-at-once", plan.merged_at_once, {2, static_cast<int>(kMaxShards)},
                "merge more shards than these in two steps");
  parser.bytes("--memory", plan.memory_bytes, "limit of the merge, as in 500MB or 2GB");
  parser.option("--until", words.until,
                "an error, as in 0.5dB: bake in rounds until the energy decay is known that well; "
                "sets --photons and --sources");
  parser.option("--program", plan.program,
                "path of clamor on the machines [unset: that of this program]");
  add_bake_options(parser, words.request);
  parser.then([&words] { return interpret(words); });
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto plan_and_schedule = [&]() -> Result<void> {
    if (auto right = check_ending(plan.output, ".clamor", "bake files"); !right.ok()) return right;
    const auto made = make_plan(words, err);
    if (!made.ok()) return made.error();
    if (auto kept = keep_plan(*made); !kept.ok()) return kept;
    return schedule(made->output, words.scheduler, Lines::kInAnyOrder, out, err);
  };
  return end_farm(err, plan_and_schedule());
}

}  // namespace

int run_farm(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  if (!arguments.empty()) {
    const auto rest = arguments.subspan(1);
    if (arguments[0] == "status") return run_farm_status(rest, out, err);
    if (arguments[0] == "resume") return run_farm_resume(rest, out, err);
    if (arguments[0] == "merge") return run_farm_merge(rest, out, err);
  }
  return run_farm_plan(arguments, out, err);
}

}  // namespace clamor
