#include "tools/farm/farm_schedulers.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <ostream>
#include <set>
#include <sstream>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "common/platform/child_program.h"
#include "common/utf8_path.h"
#include "formats/files/atomic_file.h"
#include "tools/program/interrupt.h"
#include "tools/program/shell_quote.h"

namespace clamor {

namespace {

// Slurm's default limit of an array's indices is 1000.
constexpr std::uint32_t kMostInArray = 1000;
// Three times what a merge was measured to take (bake/README.md).
constexpr double kMergeSecondsPerSource = 1e-5;
// Memory of the program that joins shards, which holds one record at a time.
constexpr std::uint64_t kJoiningBytes = 200'000'000;

std::string log_of(const FarmPlan& plan, const std::string& kind, std::uint32_t number) {
  return fmt::format("{}/{}.{}.log", FarmPlan::folder_of(plan.output), kind, number);
}

std::string last_line_of(const std::string& path) {
  std::ifstream file{path_of(path)};
  std::string last;
  for (std::string line; std::getline(file, line);)
    if (!line.empty()) last = line;
  return last;
}

std::string why_it_ended(const EndedProgram& ended, const std::string& log) {
  if (!ended.signal.empty()) return "was ended by signal " + ended.signal;
  const std::string line = last_line_of(log);
  return fmt::format("failed: {}", line.empty() ? "see " + log : line);
}

Error slurm_error(const std::string& program, const std::string& printed) {
  return Error("'" + program + "' failed (" + printed +
               "); run the command where Slurm's commands work, or without --slurm");
}

std::string job_name(const FarmPlan& plan, const std::string& kind) {
  return fmt::format("clamor-{}-{}", kind, plan.short_hash());
}

// The array tasks of a farm's jobs that are in the queue, by the number of the shard or group, and
// the ids of their jobs.
struct Queued {
  std::set<std::uint32_t> numbers;
  std::set<std::string> jobs;
};

Result<Queued> queued(const FarmPlan& plan, const std::string& kind) {
  // The comment of an array holds the number that its indices start from.
  const ProgramOutput listed = run_program(
      fmt::format("squeue --noheader --array --format='%F %K %k' --name={}", job_name(plan, kind)));
  if (!listed.ok) return slurm_error("squeue", listed.text);
  Queued found;
  std::istringstream lines(listed.text);
  std::string job;
  std::uint32_t index = 0, before = 0;
  while (lines >> job >> index >> before) {
    found.numbers.insert(before + index);
    found.jobs.insert(job);
  }
  return found;
}

struct SlurmNeeds {
  int cores = 1;
  std::uint64_t bytes = 0;
  double seconds = 0;
};

std::string script_head(const FarmPlan& plan, const std::string& kind, const SlurmNeeds& needs,
                        const std::string& log, const std::set<std::string>& after) {
  // The limits are half as much memory again and four times the time, because estimates err. The
  // log is relative to the folder that sbatch is told, whose path may have spaces.
  std::string head = fmt::format(
      "#!/bin/sh\n#SBATCH --job-name={}\n#SBATCH --cpus-per-task={}\n#SBATCH --mem={}M\n"
      "#SBATCH --time={}\n#SBATCH --output={}\n#SBATCH --open-mode=append\n#SBATCH --requeue\n",
      job_name(plan, kind), needs.cores, needs.bytes * 3 / 2 / 1'000'000 + 50,
      static_cast<int>(std::ceil(4 * needs.seconds / 60)) + 10, log);
  std::string dependency;
  for (const std::string& job : after) dependency += ":" + job;
  if (!after.empty())
    head += "#SBATCH --dependency=afterok" + dependency + "\n#SBATCH --kill-on-invalid-dep=yes\n";
  return head;
}

// Submits a script and returns the id of its job.
Result<std::string> submit(const FarmPlan& plan, const std::string& name,
                           const std::string& script) {
  const std::string path = FarmPlan::folder_of(plan.output) + "/" + name + ".sh";
  if (auto written = write_file(path, script); !written.ok()) return written.error();
  const ProgramOutput output =
      run_program("sbatch --parsable --chdir=" + shell_quoted(FarmPlan::folder_of(plan.output)) +
                  " " + shell_quoted(path));
  if (!output.ok) return slurm_error("sbatch", output.text).in(path);
  return output.text.substr(0, output.text.find(';'));  // "id;cluster"
}

// Submits the jobs as arrays whose indices are the numbers of the jobs.
Result<std::set<std::string>> submit_arrays(const FarmPlan& plan, const std::string& kind,
                                            const std::vector<FarmJob>& jobs,
                                            const SlurmNeeds& needs,
                                            const std::set<std::string>& after, std::ostream& out) {
  std::set<std::string> ids;
  std::map<std::uint32_t, std::vector<FarmJob>> arrays;  // by number before the first
  for (const FarmJob& job : jobs)
    arrays[(job.number - 1) / kMostInArray * kMostInArray].push_back(job);
  for (const auto& [before, tasks] : arrays) {
    std::vector<std::uint32_t> indices, numbers;
    std::string cases;
    for (const FarmJob& job : tasks) {
      indices.push_back(job.number - before - 1);
      numbers.push_back(job.number - 1);
      cases += fmt::format("{}) exec {} ;;\n", job.number - before, job.command);
    }
    const std::string script =
        script_head(plan, kind, needs,
                    kind + "." + (before > 0 ? std::to_string(before) + "+" : "") + "%a.log",
                    after) +
        fmt::format(
            "#SBATCH --array={}\n#SBATCH --comment={}\ncase $SLURM_ARRAY_TASK_ID in\n{}esac\n",
            ranges_of(indices), before, cases);
    const auto id = submit(
        plan, fmt::format("{}{}", kind, before > 0 ? fmt::format(".{}", before) : ""), script);
    if (!id.ok()) return id.error();
    fmt::print(out, "{} {} {}\n", *id, kind, ranges_of(numbers));
    ids.insert(*id);
  }
  return ids;
}

}  // namespace

FarmWork work_left(const FarmPlan& plan) {
  using Is = ShardState::Is;
  FarmWork work;
  bool all_done = true, runs = false;
  for (std::uint32_t shard = 0; shard < plan.shards; ++shard) {
    const ShardState state = state_of_shard(plan, shard, true);
    all_done = all_done && state.is == Is::kDone;
    runs = runs || state.is == Is::kRunning;
    if (!state.problem.empty()) work.problems.push_back(state.problem);
    if (state.is != Is::kDone && state.is != Is::kRunning)
      work.shards.push_back({shard + 1, plan.shard_command(shard)});
  }
  work.waits = runs;
  work.merges = !all_done || !is_merged(plan);
  if (work.merges)
    for (std::uint32_t group = 0; group < plan.groups(); ++group)
      if (!all_done || !is_group_done(plan, group))
        work.groups.push_back({group + 1, plan.group_command(group)});
  return work;
}

Result<void> run_here(const FarmPlan& plan, const std::string& kind,
                      const std::vector<FarmJob>& jobs, int at_once, bool quiet,
                      std::ostream& err) {
  const Interrupt interrupt;
  SignalHandlers children;
  children.heed_children();
  std::map<int, const FarmJob*> running;
  std::string failed;
  std::size_t next = 0, done = 0, failures = 0;
  bool told = false;
  while (next < jobs.size() || !running.empty()) {
    const bool stopped = Interrupt::requested();
    if (stopped && !std::exchange(told, true))
      for (const auto& [child, job] : running) ask_to_end(child);
    if (stopped && running.empty()) break;
    if (!stopped && next < jobs.size() && running.size() < static_cast<std::size_t>(at_once)) {
      const std::string& command = jobs[next].command;
      const auto child = start_program(command, log_of(plan, kind, jobs[next].number));
      if (!child)
        return Error("no process can be started for '" + command + "' (" + std::strerror(errno) +
                     "); run fewer at a time with --local");
      running[*child] = &jobs[next++];
      continue;
    }
    // A wait for the next end would go on after a signal that ends this program.
    const auto ended = next_ended_program();
    if (!ended) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const auto which = ended ? running.find(ended->process) : running.end();
    if (which == running.end()) continue;
    const FarmJob& job = *which->second;
    running.erase(which);
    ++done;
    if (ended->is_ok) {
      if (!quiet)
        fmt::print(err, "  {:<8} {} done, {} of {}\n", kind, job.number, done, jobs.size());
    } else if (!stopped) {
      // A full disk ends all of them, and a few tell why.
      if (++failures <= 3)
        failed += fmt::format("{}{} {} {}", failed.empty() ? "" : "; ", kind, job.number,
                              why_it_ended(*ended, log_of(plan, kind, job.number)));
    }
  }
  if (Interrupt::requested())
    return Error("stopped; what is traced is kept, and this continues: " + plan.resume_command() +
                 " --local " + std::to_string(at_once));
  if (failures > 3) failed += fmt::format("; and {} more failed", failures - 3);
  if (!failed.empty())
    return Error(failed + ". This makes what is missing: " + plan.resume_command());
  return {};
}

Result<void> submit_to_slurm(const FarmPlan& plan, FarmWork work, std::ostream& out) {
  const auto without_queued = [&plan](std::vector<FarmJob>& jobs,
                                      const std::string& kind) -> Result<std::set<std::string>> {
    const auto in_queue = queued(plan, kind);
    if (!in_queue.ok()) return in_queue.error();
    std::erase_if(jobs, [&](const FarmJob& job) { return in_queue->numbers.contains(job.number); });
    return in_queue->jobs;
  };
  auto shards_in_queue = without_queued(work.shards, "shard");
  if (!shards_in_queue.ok()) return shards_in_queue.error();
  const auto merges_in_queue = queued(plan, "merge");
  if (!merges_in_queue.ok()) return merges_in_queue.error();
  if (!work.merges || (work.shards.empty() && !merges_in_queue->jobs.empty())) return {};

  // Pending groups and merges wait for jobs that failed or are submitted again.
  for (const char* kind : {"group", "merge"})
    (void)run_program("scancel --state=PENDING --name=" + job_name(plan, kind));
  std::set<std::string> after = *shards_in_queue;
  const auto shards = submit_arrays(plan, "shard", work.shards,
                                    {plan.threads, plan.shard_memory_bytes, plan.shard_s}, {}, out);
  if (!shards.ok()) return shards.error();
  after.insert(shards->begin(), shards->end());
  if (!work.groups.empty()) {
    const auto groups =
        submit_arrays(plan, "group", work.groups, {1, kJoiningBytes, plan.shard_s}, after, out);
    if (!groups.ok()) return groups.error();
    after = *groups;
  }
  const std::uint64_t merge_bytes =
      plan.memory_bytes > 0 ? plan.memory_bytes : plan.merge_memory_bytes;
  const double merge_s =
      plan.preparing_s +
      kMergeSecondsPerSource * static_cast<double>(plan.rounds.times * plan.rounds.first_sources);
  std::string script =
      script_head(plan, "merge", {plan.threads, merge_bytes, merge_s}, "merge.log", after) +
      "#SBATCH --array=1\n#SBATCH --comment=0\n" + plan.merge_command();
  if (plan.goal_db > 0)
    script += " &&\n  " + shell_quoted(plan.program) + " farm resume " + shell_quoted(plan.output) +
              " --slurm";
  const auto id = submit(plan, "merge", script + "\n");
  if (!id.ok()) return id.error();
  fmt::print(out, "{} merge\n", *id);
  return {};
}

}  // namespace clamor
