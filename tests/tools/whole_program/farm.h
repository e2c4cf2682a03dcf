// farm.h: a farm of a small box, for tests, whose bake on one machine is known.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <sys/wait.h>

#include "tests/box_level.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

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
inline Shell sh(const std::string& command) {
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

inline std::size_t lines_in(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace clamor::testing
