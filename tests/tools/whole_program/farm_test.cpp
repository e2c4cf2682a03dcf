// Tests farms under xargs and GNU parallel. Whatever happens to a shard, the output has the bytes
// of a bake on one machine, or a sentence says what is wrong.
#include "tests/tools/whole_program/farm.h"

#include <cstdlib>
#include <fstream>

#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "bake/journal/trace_journal.h"
#include "formats/bake_file/bake_file.h"
#include "tests/player/program.h"

namespace clamor::testing {
namespace {

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
    run({"bake", level_, "-o", folder_ / (i + ".shard"), "--shard", i + "/2", "--photons", "14000",
         "--sources", "130000", "--probes", "4", "--probe-sources", "50", "--longest", "0.3",
         options_[6], options_[7]},
        {});
  const auto merge_to = [&](const std::string& name, const std::vector<std::string>& more) {
    run({"merge", folder_ / "1.shard", folder_ / "2.shard", "-o", folder_ / name}, more);
  };
  merge_to("memory.clamor", {});
  merge_to("disk.clamor", {"--memory", "127MB"});
  EXPECT_TRUE(read(folder_ / "memory.clamor") == read(folder_ / "disk.clamor"));
  // The memory holds 180 000 sources while they are sorted.
  const auto file = BakeFile::open(folder_ / "disk.clamor");
  ASSERT_TRUE(file.ok());
  EXPECT_GT(file->stored_sources(), 190'000u);
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

}  // namespace
}  // namespace clamor::testing
