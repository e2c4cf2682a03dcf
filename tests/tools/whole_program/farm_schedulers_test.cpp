// Tests farms on Slurm, of two nodes on the loopback that the tests start themselves, and what
// Flamenco and the simulator get of a farm.
#include <cstdlib>
#include <fstream>
#include <memory>

#include "tests/player/program.h"
#include "tests/shell.h"
#include "tests/tools/whole_program/farm.h"

namespace clamor::testing {
namespace {

// Slurm itself is tested below; here, programs of its names keep what they are told.
TEST_F(Farm, TellsSlurmTheNumbersOfShardsAndATimeThatAMergeTakes) {
  const auto program = [&](const std::string& name, const std::string& script) {
    ::chmod(folder_.write(name, "#!/bin/sh\n" + script + "\n").c_str(), 0700);
  };
  program("squeue", "");
  program("scancel", "");
  program("sbatch", "echo 7");
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", (folder_.path() + ":" + path).c_str(), 1);
  auto all = words({"--slurm"});
  all[5] = "1500";
  const auto outcome = clamor(all);
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(outcome.out, "7 shard 1-1000\n7 shard 1001-1500\n7 group 1-39\n7 merge\n")
      << outcome.err;
  // All shards together, four times over, would be a quarter of an hour and more.
  const std::string merge = read(output() + ".farm/merge.sh"), limit = "#SBATCH --time=";
  ASSERT_NE(merge.find(limit), std::string::npos) << merge;
  EXPECT_LT(std::stoi(merge.substr(merge.find(limit) + limit.size())), 20) << merge;
}

// Flamenco's Manager runs the script with an object `author`; here a few lines stand in for it.
TEST(FarmOnFlamenco, HasATaskForEachLineAndTheMergeAfterThem) {
  if (!has("node")) GTEST_SKIP() << "node is not installed";
  const Folder folder;
  folder.write("author.js", R"(
    const author = {
      Task: (name, type) => ({name, type, commands: [], after: [],
        addCommand(command) { this.commands.push(command); },
        addDependency(task) { this.after.push(task.name); }}),
      Command: (name, parameters) => ({name, ...parameters})};
    const job = {settings: {lines: "clamor bake 'a b'\nclamor bake c\n", merge: "clamor farm merge o"},
      addTask(task) {
        for (const {name, exe, args} of task.commands)
          console.log([task.name, name, exe, ...args, task.after.join("+")].join("|"));
      }};
  )");
  const auto run = sh("{ cat '" + (folder / "author.js") + "' '" + kSourceDir +
                      "/tools/farm/clamor_farm.js'; echo 'compileJob(job)'; } | node -");
  EXPECT_EQ(run.out,
            "shard-1|exec|sh|-c|clamor bake 'a b'|\n"
            "shard-2|exec|sh|-c|clamor bake c|\n"
            "merge|exec|sh|-c|clamor farm merge o|shard-1+shard-2\n");
}

TEST(FarmSimulator, ReadsTheStatusOfAFarmAndKeepsItsOwnRules) {
  if (!has("python3")) GTEST_SKIP() << "python3 is not installed";
  const std::string simulator = std::string(kSourceDir) + "/tools/farm/simulate.py";
  EXPECT_EQ(sh(simulator + " --self-test").code, 0);
  const auto table =
      sh(std::string("echo '{\"bytes\": 0, \"preparing_s\": 0, \"shards\": [") +
         "{\"state\": \"done\", \"core_seconds\": 8}]}' | " + simulator + " --machines 16");
  EXPECT_NE(table.out.find("| 16 | 64 | 0.5 s | 0.0 s | 0.5 s | 1.00 |"), std::string::npos)
      << table.out;
}

// Slurm, with two nodes on this machine.
class Slurm {
 public:
  explicit Slurm(const std::string& folder) : folder_(folder) {
    std::ofstream key(folder_ + "/munge.key", std::ios::binary);
    for (int i = 0; i < 128; ++i) key << static_cast<char>(std::rand());
    key.close();
    ::chmod((folder_ + "/munge.key").c_str(), 0600);
    const int port = 20000 + static_cast<int>(::getpid() % 10000) * 3;
    const std::string at = folder_ + "/";
    std::ofstream(at + "slurm.conf")
        << "ClusterName=clamor\nSlurmctldHost=localhost(127.0.0.1)\nSlurmctldPort=" << port
        << "\nSlurmUser=root\nSlurmdUser=root\nAuthType=auth/munge\nAuthInfo=socket=" << at
        << "munge.sock\nCredType=cred/munge\nStateSaveLocation=" << at
        << "state\nSlurmdSpoolDir=" << at << "%n\nSlurmctldPidFile=" << at
        << "slurmctld.pid\nSlurmdPidFile=" << at << "%n.pid\nSlurmctldLogFile=" << at
        << "slurmctld.log\nSlurmdLogFile=" << at
        << "%n.log\nSlurmdParameters=config_overrides\nProctrackType=proctrack/linuxproc\n"
           "TaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\n"
           "AccountingStorageType=accounting_storage/none\nSelectType=select/cons_tres\n"
           "SelectTypeParameters=CR_Core\nSchedulerParameters=sched_min_interval=100000,"
           "sched_interval=1,batch_sched_delay=0,bf_interval=1\nMpiDefault=none\n"
           "SwitchType=switch/none\nKillWait=1\nJobRequeue=1\n"
           // A lost node stays down, even if an answer that it gave before arrives late.
           "ReturnToService=0\n"
           // A busy machine must not make a daemon look dead, nor a job look lost.
           "SlurmdTimeout=600\nMessageTimeout=90\nTCPTimeout=60\nBatchStartTimeout=600\n"
           "UnkillableStepTimeout=600\n";
    std::ofstream conf(at + "slurm.conf", std::ios::app);
    for (const int node : {1, 2})
      conf << "NodeName=node" << node
           << " NodeHostname=localhost NodeAddr=127.0.0.1 Port=" << port + node
           << " CPUs=2 RealMemory=4000\n";
    conf << "PartitionName=all Nodes=node[1-2] Default=YES State=UP\n";
    conf.close();
    // Nothing here needs control groups. Left to choose, slurmd ends where /sys is not mounted, as
    // in a plain container.
    std::ofstream(at + "cgroup.conf") << "CgroupPlugin=cgroup/v1\n";
    ::setenv("SLURM_CONF", (at + "slurm.conf").c_str(), 1);
    for (const char* name : {"state", "node1", "node2"}) fs::create_directories(at + name);
    start({"munged", "--foreground", "--force", "--socket=" + at + "munge.sock",
           "--key-file=" + at + "munge.key", "--pid-file=" + at + "munged.pid",
           "--log-file=" + at + "munged.log", "--seed-file=" + at + "munged.seed"});
    (void)comes_true([&] { return fs::exists(at + "munge.sock"); });
    start({"slurmctld", "-D"});
    for (const int node : {1, 2}) start({"slurmd", "-D", "-N", "node" + std::to_string(node)});
  }
  ~Slurm() {
    // Daemons that are asked to end wait for seconds, and their state is of no use.
    for (; !programs_.empty(); programs_.pop_back()) programs_.back()->stop(SIGKILL);
    ::unsetenv("SLURM_CONF");
  }

  static bool is_installed() {
    return has("slurmctld") && has("slurmd") && has("munged") && ::geteuid() == 0;
  }
  bool is_up() const {
    (void)comes_true([this] { return !all_run() || sh("sinfo -h -t idle -o %D").out == "2\n"; });
    return all_run() && sh("sinfo -h -t idle -o %D").out == "2\n";
  }
  static bool is_idle() {
    return comes_true([] { return sh("squeue -h").out.empty(); });
  }
  // Ends a node as a power cut does: its daemon and all processes of its only job. Slurm requeues
  // the job, which waits for two minutes unless it is told not to.
  void lose_node_of(pid_t process, const std::string& node, const std::string& job) {
    std::vector<pid_t> lineage{process};
    while (lineage.back() > 1 && name_of(lineage.back()) != "slurmstepd")
      lineage.push_back(parent_of(lineage.back()));
    programs_[node == "node1" ? 2 : 3]->stop(SIGKILL);
    // The step's daemon goes first, which would report how the job ended.
    for (; !lineage.empty(); lineage.pop_back())
      if (lineage.back() > 1) ::kill(lineage.back(), SIGKILL);
    EXPECT_EQ(sh("scontrol update nodename=" + node + " state=down reason=lost").code, 0);
    EXPECT_TRUE(comes_true([&] {
      return sh("scontrol update jobid=" + job + " starttime=now").code == 0;
    })) << sh("squeue; sinfo").out;
  }

 private:
  void start(const std::vector<std::string>& command) {
    programs_.push_back(
        std::make_unique<Program>(command, folder_ + "/daemon" + std::to_string(programs_.size())));
  }
  bool all_run() const {
    return std::ranges::all_of(programs_, [](const auto& program) { return program->runs(); });
  }
  static pid_t parent_of(pid_t process) {
    std::ifstream status("/proc/" + std::to_string(process) + "/status");
    for (std::string word; status >> word;)
      if (pid_t parent = 0; word == "PPid:" && status >> parent) return parent;
    return 1;
  }
  static std::string name_of(pid_t process) {
    std::string name;
    std::ifstream("/proc/" + std::to_string(process) + "/comm") >> name;
    return name;
  }

  std::string folder_;
  std::vector<std::unique_ptr<Program>> programs_;
};

TEST_F(Farm, OnSlurmGivesTheBytesOfOneMachineWhateverIsCancelledKilledOrRequeued) {
  if (!Slurm::is_installed())
    GTEST_SKIP() << "slurm-wlm and munge are not installed, or this is not root";
  const Folder daemons;
  Slurm slurm(daemons.path());
  ASSERT_TRUE(slurm.is_up()) << sh("sinfo; tail -n 20 " + daemons.path() + "/*.log").out;

  // Nothing happens.
  const auto ids = clamor(words({"--slurm"}));
  ASSERT_EQ(ids.code, 0) << ids.err;
  EXPECT_EQ(lines_in(ids.out), 2u) << "an array and the merge: " << ids.out;
  EXPECT_EQ(resume({"--slurm"}).out, "") << "all is in the queue";
  ASSERT_TRUE(Slurm::is_idle());
  expect_the_same_bytes();
  EXPECT_EQ(resume({"--slurm"}).out, "");

  // The job of shard 2 hangs in its middle, until something happens to it.
  const auto begin_again = [&](const std::string& name) {
    fs::remove_all(output() + ".farm");
    fs::remove(output());
    fs::remove(folder_ / "struck");
    program_ = program_that_once("(ulimit -f 8; " + std::string(kProgram) +
                                 " \"$@\")\necho $SLURMD_NODENAME $SLURM_ARRAY_JOB_ID $$ > '" +
                                 (folder_ / "at") + "' && mv '" + (folder_ / "at") + "' '" +
                                 (folder_ / name) + "'\nexec sleep 1000");
    EXPECT_EQ(clamor(words({"--slurm"})).code, 0);
    EXPECT_TRUE(comes_true([&] { return fs::exists(folder_ / name); }));
    struct {
      std::string node, job;
      pid_t shell = 0;
    } at;
    std::ifstream(folder_ / name) >> at.node >> at.job >> at.shell;
    return at;
  };

  // The array is cancelled, with shard 2 in its middle, and resumed.
  auto at = begin_again("cancelled");
  EXPECT_EQ(state_of(2), "lost");
  EXPECT_EQ(sh("scancel " + at.job).code, 0);
  ASSERT_TRUE(Slurm::is_idle()) << "the merge must not wait for an array that was cancelled";
  EXPECT_EQ(state_of(2), "lost");
  EXPECT_FALSE(fs::exists(output()));
  EXPECT_NE(resume({"--slurm"}).out.find("shard"), std::string::npos);
  ASSERT_TRUE(Slurm::is_idle());
  expect_the_same_bytes();

  // The node of shard 2 is lost, when no other shard is left in the queue: Slurm requeues it on the
  // other.
  at = begin_again("lost");
  ASSERT_TRUE(comes_true([&] { return lines_in(sh("squeue -h -r --jobs=" + at.job).out) == 1; }))
      << sh("squeue; sinfo").out;
  slurm.lose_node_of(at.shell, at.node, at.job + "_2");
  ASSERT_TRUE(Slurm::is_idle()) << sh("squeue; sinfo").out;
  expect_the_same_bytes();
}

}  // namespace
}  // namespace clamor::testing
