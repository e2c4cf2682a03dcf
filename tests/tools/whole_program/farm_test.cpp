// Tests farms on schedulers that are installed: xargs, GNU parallel, and a Slurm of two nodes on
// the loopback that the tests start themselves. Whatever happens to a shard, the output has the
// bytes of a bake on one machine, or a sentence says what is wrong.
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <thread>

#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "bake/journal/trace_journal.h"
#include "formats/bake_file/bake_file.h"
#include "tests/box_level.h"
#include "tests/player/program.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {
namespace {

namespace fs = std::filesystem;

// Waits for a condition that comes true in a second or two, but later on a busy machine. The limit
// of four minutes only ends a test that fails.
template <class Condition>
bool comes_true(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(4);
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return condition();
}

struct Shell {
  int code;
  std::string out;
};

// What a command prints on both streams.
Shell sh(const std::string& command) {
  Shell outcome{-1, ""};
  FILE* const pipe = ::popen(("{ " + command + "\n} 2>&1").c_str(), "r");
  if (pipe == nullptr) return outcome;
  char some[4096];
  while (const std::size_t got = std::fread(some, 1, sizeof some, pipe))
    outcome.out.append(some, got);
  const int status = ::pclose(pipe);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

// A farm of a box, whose bake on one machine is known.
class Farm : public ::testing::Test {
 protected:
  Farm() {
    level_ = box_level(folder_);
    program_ = kProgram;
  }

  // The words of a farm of 4 shards.
  std::vector<std::string> words(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{"farm", level_,    "-o",        output(), "--shards",
                                 "4",    "--quiet", "--program", program_};
    all.insert(all.end(), options_.begin(), options_.end());
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  Outcome resume(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{"farm", "resume", output(), "--quiet"};
    all.insert(all.end(), more.begin(), more.end());
    return clamor(all);
  }
  nlohmann::json status() const {
    const auto outcome = clamor({"farm", "status", output(), "--json"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }
  std::string state_of(std::size_t shard) const { return status()["shards"][shard - 1]["state"]; }
  // A path that a shell and Slurm take apart unless it is quoted.
  std::string output() const { return folder_ / "a farm.clamor"; }
  std::string shard(int number) const {
    return output() + ".farm/" + std::to_string(number) + ".shard";
  }

  // The bytes of a bake on one machine.
  std::string one() const {
    static const std::string bytes = [this] {
      std::vector<std::string> all{"bake",         level_,   "-o", folder_ / "one.clamor",
                                   "--no-journal", "--quiet"};
      all.insert(all.end(), options_.begin(), options_.end());
      EXPECT_EQ(clamor(all).code, 0);
      return read(folder_ / "one.clamor");
    }();
    return bytes;
  }
  void expect_the_same_bytes() const {
    EXPECT_TRUE(fs::exists(output()));
    EXPECT_TRUE(read(output()) == one());
    EXPECT_EQ(resume().out, "") << "all is done";
  }

  // A program that does something else instead when it is first asked for shard 2.
  std::string program_that_once(const std::string& instead) const {
    const std::string path =
        folder_.write("program", "#!/bin/sh\ncase \"$*\" in *\" " + shard(2) + " \"*) if mkdir '" +
                                     (folder_ / "struck") + "' 2>/dev/null; then\n" + instead +
                                     "\nfi ;; esac\nexec " + kProgram + " \"$@\"\n");
    ::chmod(path.c_str(), 0700);
    return path;
  }
  // Lines of a program that dies in the middle of shard 2, without a chance to tidy up.
  static std::string death() {
    return std::string("(ulimit -f 8; ") + kProgram + " \"$@\")\nkill -9 $$";
  }

  const Folder folder_;
  std::string level_, program_;
  const std::vector<std::string> options_{
      "--photons", "8000", "--sources", "2000",
      "--longest", "0.05", "--emitter", "name=click,signal=impulse,at=1,1.2,1"};
};

std::size_t lines_in(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST_F(Farm, PrintsLinesThatXargsRunsToTheBytesOfOneMachine) {
  const auto plan = clamor(words());
  ASSERT_EQ(plan.code, 0) << plan.err;
  EXPECT_EQ(lines_in(plan.out), 4u);
  EXPECT_EQ(status()["counts"]["waiting"], 4);
  folder_.write("lines", plan.out);
  const auto run = sh("cd / && xargs -d '\\n' -n 1 -P 2 sh -c < " + folder_ / "lines");
  EXPECT_EQ(run.code, 0) << run.out;
  EXPECT_EQ(status()["counts"]["done"], 4);
  EXPECT_EQ(status()["photons"], status()["photons_total"]);
  EXPECT_GT(status()["error_db"], 0.01);
  const auto merge = resume();
  EXPECT_EQ(lines_in(merge.out), 1u) << merge.out;
  EXPECT_EQ(sh(merge.out).code, 0);
  expect_the_same_bytes();
}

void expect_keys_in(const std::string& page, const nlohmann::json& json) {
  for (const auto& [key, value] : json.items()) {
    if (json.is_object()) {
      EXPECT_NE(page.find("`" + key + "`"), std::string::npos) << key;
    }
    if (value.is_structured()) expect_keys_in(page, value);
  }
}

TEST_F(Farm, HasAStatusWhoseKeysAreDocumented) {
  ASSERT_EQ(clamor(words({"--local", "2"})).code, 0);
  folder_.write("a farm.clamor.farm/1.shard", "damaged");
  const auto keys = status();
  EXPECT_EQ(keys["counts"]["wrong"], 1);
  expect_keys_in(read(std::string(kSourceDir) + "/bake/README.md"), keys);
}

TEST_F(Farm, TellsWhyAFewOfItsShardsFailed) {
  program_ = "false";
  const auto outcome = clamor(words({"--local", "1"}));
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("shard 3 failed"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("shard 4 failed"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("1 more failed"), std::string::npos) << outcome.err;
}

TEST_F(Farm, PrintsLinesThatNeedNeitherAFolderNorAnEnvironment) {
  const auto plan = clamor(words());
  ASSERT_EQ(plan.code, 0) << plan.err;
  const std::string line = plan.out.substr(0, plan.out.find('\n'));
  EXPECT_EQ(state_of(1), "waiting");
  folder_.write("line", line);
  const auto run = sh("cd / && line=$(cat '" + (folder_ / "line") +
                      "') && env -i PATH=/usr/bin:/bin sh -c \"$line\"");
  EXPECT_EQ(run.code, 0) << run.out;
  EXPECT_EQ(state_of(1), "done");
  EXPECT_EQ(status()["counts"]["waiting"], 3);
}

// A pipe to a shell would run what follows the break as a command of its own.
TEST_F(Farm, RefusesALineBreakInWhatItsLinesWouldHold) {
  const auto refused = [](const std::vector<std::string>& words) {
    const auto outcome = clamor(words);
    EXPECT_EQ(outcome.code, 1);
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err.find("holds a line break"), std::string::npos) << outcome.err;
  };
  auto emitter = words();
  std::ranges::find(emitter, options_.back())->insert(std::string("name=cl").size(), "\nfalse ");
  refused(emitter);
  const std::string folder = folder_ / "two\nfalse lines";
  fs::create_directory(folder);
  fs::copy_file(level_, folder + "/level.gltf");
  auto level = words();
  level[1] = folder + "/level.gltf";
  refused(level);
  auto output = words();
  output[3] = folder + "/room.clamor";
  refused(output);
}

TEST_F(Farm, MergesInAnyFolderWhatNamesFilesRelativeToOne) {
  folder_.write("side.json", R"({"materials": {"*": {"absorption": 0.5}}})");
  std::string words_of_plan;
  for (const std::string& word : words({"--acoustics", "side.json"}))
    words_of_plan += " '" + word + "'";
  const auto lines = sh("cd '" + folder_.path() + "' && " + kProgram + words_of_plan);
  ASSERT_EQ(lines.code, 0) << lines.out;
  EXPECT_EQ(sh("cd / && { " + lines.out + "}").code, 0);
  const auto before = fs::current_path();
  const auto merge = clamor({"farm", "merge", output()});
  EXPECT_EQ(merge.code, 0) << merge.err;
  EXPECT_EQ(fs::current_path(), before);
  EXPECT_TRUE(status()["merged"]);
}

TEST_F(Farm, RunsUnderGnuParallel) {
  if (sh("parallel --version").out.find("GNU parallel") == std::string::npos)
    GTEST_SKIP() << "GNU parallel is not installed";
  folder_.write("lines", clamor(words()).out);
  const auto run = sh("parallel --will-cite -j 2 < " + folder_ / "lines");
  EXPECT_EQ(run.code, 0) << run.out;
  EXPECT_EQ(sh(resume().out).code, 0);
  expect_the_same_bytes();
}

TEST_F(Farm, LosesOneShardWhenItsMachineDies) {
  program_ = program_that_once(death());
  const auto first = clamor(words({"--local", "2"}));
  EXPECT_EQ(first.code, 1);
  EXPECT_NE(first.err.find("shard 2 was ended by signal"), std::string::npos) << first.err;
  EXPECT_EQ(state_of(2), "lost");
  EXPECT_EQ(status()["counts"]["done"], 3);
  EXPECT_FALSE(fs::exists(output()));
  const auto left = resume();
  EXPECT_EQ(lines_in(left.out), 2u) << "the shard and the merge: " << left.out;
  EXPECT_EQ(sh(left.out).code, 0);
  expect_the_same_bytes();
}

TEST_F(Farm, TellsAShardThatRunsFromOneThatIsLost) {
  program_ = program_that_once(death());
  EXPECT_EQ(clamor(words({"--local", "1"})).code, 1);
  {
    const auto writer = TraceJournal::open(shard(2), 1);
    ASSERT_TRUE(writer.ok());
    EXPECT_EQ(state_of(2), "running");
    EXPECT_EQ(resume().out, "") << "nothing is missing, and the merge has to wait";
  }
  EXPECT_EQ(state_of(2), "lost");
}

TEST_F(Farm, SaysThatTheDiskOfAShardIsFullAndGoesOnLater) {
  program_ = program_that_once("ulimit -f 8\nexec " + std::string(kProgram) + " \"$@\"");
  const auto first = clamor(words({"--local", "2"}));
  EXPECT_EQ(first.code, 1);
  EXPECT_NE(first.err.find("shard 2 failed: clamor bake: "), std::string::npos) << first.err;
  EXPECT_NE(first.err.find("cannot be written (File too large)"), std::string::npos) << first.err;
  EXPECT_EQ(resume({"--local", "2"}).code, 0);
  expect_the_same_bytes();
}

TEST_F(Farm, MakesAgainOnlyTheShardThatIsDamagedOrAnother) {
  ASSERT_EQ(clamor(words({"--local", "2"})).code, 0);
  fs::remove(output());
  const std::string whole = read(shard(3));
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 1);
  const std::string cut = whole.substr(0, whole.size() - 5), text = "text";
  for (const std::string& bytes : {cut, flipped, text, read(shard(2))}) {
    std::ofstream(shard(3), std::ios::binary) << bytes;
    const auto left = resume();
    // One that is cut short at the end of a record is like one whose bake was stopped.
    if (bytes != cut) {
      EXPECT_NE(left.err.find(shard(3) + ": "), std::string::npos) << left.err;
    }
    EXPECT_NE(left.out.find(shard(3)), std::string::npos) << left.out;
    EXPECT_EQ(lines_in(left.out), 2u) << "the shard and the merge: " << left.out;
    EXPECT_EQ(clamor({"farm", "merge", output()}).code, 1);
    EXPECT_FALSE(fs::exists(output()));
  }
  fs::remove(shard(3));
  EXPECT_EQ(resume({"--local", "1"}).code, 0);
  expect_the_same_bytes();
}

TEST_F(Farm, NamesAShardOfAnotherStateOfTheLevel) {
  ASSERT_EQ(clamor(words({"--local", "2"})).code, 0);
  const std::string level = read(level_);
  std::ofstream(level_) << level << " ";
  const auto again = clamor(words());
  EXPECT_EQ(again.code, 1);
  EXPECT_NE(again.err.find("holds another farm"), std::string::npos) << again.err;
  fs::remove(output());
  const auto merge = clamor({"farm", "merge", output()});
  EXPECT_EQ(merge.code, 1);
  EXPECT_NE(merge.err.find(shard(1) + ": is stale"), std::string::npos) << merge.err;
}

TEST_F(Farm, StandsBesideAnotherInTheSameFolderAndIgnoresClocks) {
  std::vector<std::string> other = words({"--seed", "5", "--local", "1"});
  other[3] = folder_ / "other.clamor";
  ASSERT_EQ(clamor(other).code, 0);
  ASSERT_EQ(clamor(words({"--local", "2"})).code, 0);
  EXPECT_TRUE(read(output()) != read(folder_ / "other.clamor"));
  // One machine's clock is a day late, another's a day early.
  fs::remove(output());
  const auto now = fs::file_time_type::clock::now();
  const auto day = std::chrono::hours(24);
  for (const int number : {1, 2, 3, 4})
    fs::last_write_time(shard(number), now + (number - 2) * day);
  fs::last_write_time(output() + ".farm/farm.json", now + 2 * day);
  EXPECT_EQ(status()["counts"]["done"], 4);
  EXPECT_EQ(resume({"--local", "1"}).code, 0);
  expect_the_same_bytes();
}

TEST_F(Farm, MergesInTwoStepsWhereThereAreManyShards) {
  const auto outcome = clamor(words({"--local", "2", "--merge-at-once", "3"}));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(output() + ".farm/group.2.shard"));
  expect_the_same_bytes();
}

TEST_F(Farm, MergesOnDiskWhereTheMemoryIsShort) {
  // A portal that is baked open and closed, and probes.
  folder_.write("box.acoustics.json", R"({"portals": [{"name": "Door", "at": [2, 1.5, 2.5],
      "size": [4, 3], "facing": [0, 0, 1], "baked": "both"}]})");
  const auto run = [](std::vector<std::string> all, const std::vector<std::string>& more) {
    all.insert(all.end(), {"--quiet", "--threads", "2"});
    all.insert(all.end(), more.begin(), more.end());
    const auto outcome = clamor(all);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
  };
  for (const std::string i : {"1", "2"})
    run({"bake", level_, "-o", folder_ / (i + ".shard"), "--shard", i + "/2", "--photons", "8000",
         "--sources", "95000", "--probes", "4", "--probe-sources", "50", "--longest", "0.3",
         options_[6], options_[7]},
        {});
  const auto merge_to = [&](const std::string& name, const std::vector<std::string>& more) {
    run({"merge", folder_ / "1.shard", folder_ / "2.shard", "-o", folder_ / name}, more);
  };
  merge_to("memory.clamor", {});
  merge_to("disk.clamor", {"--memory", "127MB"});
  EXPECT_TRUE(read(folder_ / "memory.clamor") == read(folder_ / "disk.clamor"));
  // The memory holds 144 000 sources while they are sorted.
  const auto file = BakeFile::open(folder_ / "disk.clamor");
  ASSERT_TRUE(file.ok());
  EXPECT_GT(file->stored_sources(), 150'000u);
}

TEST_F(Farm, TracesInRoundsUntilAnErrorLikeOneMachine) {
  const std::vector<std::string> more{"--until",   "0.4dB",    "--longest",       "0.1",
                                      "--probes",  "4",        "--probe-sources", "50",
                                      options_[6], options_[7]};
  const auto with = [&](std::vector<std::string> all) {
    all.insert(all.end(), more.begin(), more.end());
    return clamor(all);
  };
  ASSERT_EQ(with({"bake", level_, "-o", folder_ / "one.clamor", "--no-journal", "--quiet"}).code,
            0);
  const auto outcome = with({"farm", level_, "-o", output(), "--shards", "3", "--local", "2",
                             "--quiet", "--program", program_});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_GT(status()["round"], 1);
  EXPECT_TRUE(read(output()) == read(folder_ / "one.clamor"));
  EXPECT_EQ(with({"farm", level_, "-o", output(), "--shards", "3", "--until", "9min"}).code, 2);
}

TEST_F(Farm, MergesGroupsThatNothingHasJoinedYetAndJoinsDamagedOnesAgain) {
  const auto plan = clamor(words({"--merge-at-once", "3"}));
  ASSERT_EQ(plan.code, 0);
  EXPECT_EQ(sh(plan.out).code, 0);
  const auto merge = clamor({"farm", "merge", output()});
  EXPECT_EQ(merge.code, 0) << merge.err;
  expect_the_same_bytes();
  fs::remove(output());
  const std::string group = output() + ".farm/group.1.shard";
  std::string bytes = read(group);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  std::ofstream(group, std::ios::binary) << bytes;
  const auto again = clamor({"farm", "merge", output()});
  EXPECT_EQ(again.code, 0) << again.err;
  expect_the_same_bytes();
}

TEST_F(Farm, PlansARoundOnceHoweverOftenItMerges) {
  const std::vector<std::string> plan{
      "farm",      level_, "-o",        output(),    "--shards",  "1",      "--until", "0.4dB",
      "--longest", "0.1",  options_[6], options_[7], "--program", program_, "--quiet"};
  const auto merge_memory = [&] {
    return nlohmann::json::parse(read(output() + ".farm/farm.json"))["merge_memory_bytes"]
        .get<double>();
  };
  const auto first = clamor(plan);
  ASSERT_EQ(first.code, 0) << first.err;
  const double memory_of_first = merge_memory();
  EXPECT_EQ(sh(first.out).code, 0);
  EXPECT_EQ(sh(resume().out).code, 0);
  const auto second = status();
  ASSERT_EQ(second["round"], 2);
  EXPECT_GT(merge_memory(), memory_of_first);
  // A scheduler runs the merge again, and a person plans the farm again.
  const auto again = clamor({"farm", "merge", output()});
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(status()["round"], 2);
  EXPECT_EQ(clamor(plan).code, 0);
  EXPECT_EQ(status()["round"], 2);
  EXPECT_EQ(status()["photons_total"], second["photons_total"]);
  EXPECT_GT(merge_memory(), memory_of_first);
}

TEST_F(Farm, EndsWhereItsProgramDoesNothing) {
  program_ = "true";
  const auto outcome = clamor(words({"--local", "1"}));
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("check --program true"), std::string::npos) << outcome.err;
}

TEST_F(Farm, IsNotContinuedByAnotherVersion) {
  ASSERT_EQ(clamor(words()).code, 0);
  const std::string plan = output() + ".farm/farm.json";
  auto json = nlohmann::json::parse(read(plan));
  json["made_by"] = "clamor 0.0.9/1";
  std::ofstream(plan) << json;
  for (const auto& outcome :
       {resume(), resume({"--local", "1"}), clamor(words()), clamor({"farm", "merge", output()})}) {
    EXPECT_EQ(outcome.code, 1);
    EXPECT_NE(outcome.err.find("version"), std::string::npos) << outcome.err;
  }
}

TEST_F(Farm, RefusesAnOutputThatItsMergeCouldNotWrite) {
  for (const std::string& refused :
       {level_, std::string("/dev/null"), folder_ / "nothing/farm.clamor", std::string()}) {
    auto all = words();
    all[3] = refused;
    const auto outcome = clamor(all);
    EXPECT_EQ(outcome.code, 1) << refused;
    EXPECT_FALSE(fs::exists(refused + ".farm"));
  }
}

TEST_F(Farm, StopsItsShardsWhenItIsAskedToEnd) {
  program_ = program_that_once("touch '" + (folder_ / "begun") + "'\nsleep 30\ntouch '" +
                               (folder_ / "ended") + "'");
  std::vector<std::string> all = words({"--local", "2"});
  all.insert(all.begin(), kProgram);
  Program farm(all, folder_ / "farm");
  ASSERT_TRUE(comes_true([&] { return fs::exists(folder_ / "begun"); }));
  farm.stop(SIGTERM);
  EXPECT_FALSE(fs::exists(folder_ / "ended")) << "it waited for the shard";
  EXPECT_NE(read(folder_ / "farm.log").find("stopped; what is traced is kept"), std::string::npos)
      << read(folder_ / "farm.log");
  EXPECT_EQ(resume({"--local", "2"}).code, 0);
  expect_the_same_bytes();
}

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
  if (!installed("node")) GTEST_SKIP() << "node is not installed";
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
  if (!installed("python3")) GTEST_SKIP() << "python3 is not installed";
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
    return installed("slurmctld") && installed("slurmd") && installed("munged") && ::geteuid() == 0;
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
