// Tests that bakes that are killed, stopped or run out of disk keep what was traced, and that the
// same command then ends in the same bytes. The program runs in processes of its own.
#include <cerrno>
#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include "formats/bake_file/expanded_sources.h"
#include "tests/build_paths.h"
#include "tests/sanitized.h"
#include "tests/tools/run_clamor.h"
#include "tools/program/interrupt.h"

namespace clamor {
namespace {

using testing::Folder;
using testing::read;
using testing::violin_room;

struct Ended {
  bool killed = false;
  int code = -1;
};

// Bakes the violin room in a process of its own, with its messages in `log`. After `signal_after`
// it gets the signal, if it still runs. Files may grow to `max_file_bytes`.
Ended run_bake(const std::vector<std::string>& arguments, const std::string& log,
               std::chrono::microseconds signal_after = std::chrono::hours(1), int signal = SIGKILL,
               rlim_t max_file_bytes = RLIM_INFINITY, const char* tunables = nullptr) {
  const pid_t child = ::fork();
  if (child == 0) {
    const int descriptor = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    ::dup2(descriptor, STDERR_FILENO);
    ::dup2(descriptor, STDOUT_FILENO);
    if (max_file_bytes != RLIM_INFINITY) {
      std::signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{max_file_bytes, max_file_bytes};
      ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    if (tunables != nullptr) ::setenv("GLIBC_TUNABLES", tunables, 1);
    std::vector<char*> words{const_cast<char*>(testing::kProgram), const_cast<char*>("bake")};
    for (const std::string& argument : arguments)
      words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    ::execv(testing::kProgram, words.data());
    ::_exit(127);
  }
  const auto deadline = std::chrono::steady_clock::now() + signal_after;
  int status = 0;
  bool signalled = false;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    if (!signalled && std::chrono::steady_clock::now() >= deadline) {
      ::kill(child, signal);
      signalled = true;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  return {WIFSIGNALED(status) != 0, WIFEXITED(status) ? WEXITSTATUS(status) : -1};
}

std::vector<std::string> bake_of(const std::string& level, const std::string& output) {
  return {level,       "-o",        output,
          "--photons", "6000",      "--sources",
          "4000",      "--emitter", "name=violin,signal=impulse,at=1,1.2,1",
          "--quiet"};
}

TEST(KilledBake, GoesOnToTheSameBytesAfterKillsAtAnyMoment_NoAsan) {
  const Folder folder;
  const std::string log = folder / "log";
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(run_bake(bake_of(violin_room(), folder / "whole.clamor"), log).code, 0) << read(log);
  const std::chrono::duration<double, std::micro> whole_time =
      std::chrono::steady_clock::now() - start;
  const std::string whole = read(folder / "whole.clamor");

  std::mt19937 random(1);
  constexpr int kKills = 20, kWithJournal = 5;  // at least, of which so many once tracing began
  // The moments of the kills spread over a little more than a whole bake: starting, importing,
  // tracing, sorting, writing. The range adapts to the load of the machine: it shrinks with each
  // bake that ended before its kill.
  double last_moment = 1.1 * whole_time.count();
  int kills = 0, with_journal = 0;
  for (int tries = 0; (kills < kKills || with_journal < kWithJournal) && tries < 4 * kKills;
       ++tries) {
    std::uniform_real_distribution<double> moments(0, last_moment);
    const Ended ended = run_bake(bake_of(violin_room(), folder / "cut.clamor"), log,
                                 std::chrono::microseconds(static_cast<long>(moments(random))));
    last_moment *= ended.killed ? 1.02 : 0.8;  // settles at 1.09 of a bake
    if (ended.killed) {
      ++kills;
      if (std::filesystem::exists(folder / "cut.clamor.journal")) ++with_journal;
      // There is never half an output.
      if (std::filesystem::exists(folder / "cut.clamor")) {
        ASSERT_TRUE(read(folder / "cut.clamor") == whole);
      }
    } else {
      ASSERT_EQ(ended.code, 0) << read(log);
      ASSERT_TRUE(read(folder / "cut.clamor") == whole);
      std::filesystem::remove(folder / "cut.clamor");
    }
  }
  EXPECT_GE(kills, kKills);
  EXPECT_GE(with_journal, kWithJournal);
  ASSERT_EQ(run_bake(bake_of(violin_room(), folder / "cut.clamor"), log).code, 0) << read(log);
  EXPECT_TRUE(read(folder / "cut.clamor") == whole);
  // Temporary files of killed bakes are removed.
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"cut.clamor", "log", "whole.clamor"}));
}

TEST(BakeProgram, WritesTheSameBytesWhateverTheCLibraryMakesOfTheCpu_NoAsan) {
  // Without AVX2 and FMA, exp, sin and other functions of the C library round differently.
  const Folder folder;
  const std::string log = folder / "log";
  ASSERT_EQ(run_bake(bake_of(violin_room(), folder / "a.clamor"), log).code, 0) << read(log);
  ASSERT_EQ(
      run_bake(bake_of(violin_room(), folder / "b.clamor"), log, std::chrono::hours(1), SIGKILL,
               RLIM_INFINITY, "glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA,-AVX512F,-ERMS")
          .code,
      0)
      << read(log);
  EXPECT_TRUE(read(folder / "a.clamor") == read(folder / "b.clamor"));
}

TEST(MemoryCap, IsSaidBeforeTheBakeStartsAndIsAboveWhatItTakes) {
  const Folder folder;
  const std::string log = folder / "log";
  auto words = bake_of(violin_room(), folder / "out.clamor");
  words[4] = "2000";
  words[6] = "300000";
  words.insert(words.end(), {"--memory", "120MB"});
  EXPECT_EQ(run_bake(words, log).code, 1);
  const std::string sentence = read(log);
  const std::size_t place = sentence.find("needs about ");
  ASSERT_NE(place, std::string::npos) << sentence;
  EXPECT_NE(sentence.find("--sources "), std::string::npos) << sentence;
  EXPECT_EQ(folder.names(), std::vector<std::string>{"log"});
  const long needed_MB = std::stol(sentence.substr(place + 12));
  EXPECT_GT(needed_MB, 120);
  if (testing::kSanitized) return;  // the sanitizer itself takes memory
  words[4] = "20000";
  words.back() = std::to_string(needed_MB) + "MB";
  EXPECT_EQ(run_bake(words, log).code, 0) << read(log);
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);  // the largest child so far
  EXPECT_LT(usage.ru_maxrss / 1000, needed_MB);
  EXPECT_GT(usage.ru_maxrss / 1000, needed_MB / 2);
  // With so little memory the octree is sorted on disk, with the same result.
  words[2] = folder / "plain.clamor";
  words.back() = "4GB";
  ASSERT_EQ(run_bake(words, log).code, 0) << read(log);
  const auto plain = BakeFile::open(folder / "plain.clamor"),
             sorted = BakeFile::open(folder / "out.clamor");
  ASSERT_TRUE(plain.ok() && sorted.ok());
  EXPECT_EQ(plain->page_count(), sorted->page_count());
  EXPECT_EQ(plain->depths(), sorted->depths());
  const auto all = read_expanded_sources(*plain), all_sorted = read_expanded_sources(*sorted);
  ASSERT_TRUE(all.ok() && all_sorted.ok());
  ASSERT_EQ(all->sources.size(), all_sorted->sources.size());
  for (std::size_t i = 0; i < all->sources.size(); ++i) {
    ASSERT_EQ(all->sources[i].position_m, all_sorted->sources[i].position_m) << i;
    ASSERT_EQ(all->sources[i].power, all_sorted->sources[i].power) << i;
  }
}

TEST(StoppedBake, SaysHowToGoOnAndGoesOn_NoAsan) {
  const Folder folder;
  const std::string log = folder / "log";
  auto long_bake = bake_of(violin_room(), folder / "out.clamor");
  long_bake[4] = "400000";
  const auto start = std::chrono::steady_clock::now();
  Ended ended;
  std::chrono::milliseconds after(300);
  // Repeats until the bake is stopped after it has traced something.
  do {
    ended = run_bake(long_bake, log, after, SIGINT);
    after *= 2;
  } while (ended.code != 0 && read(folder / "out.clamor.journal").size() <= 16 &&
           std::chrono::steady_clock::now() - start < std::chrono::minutes(2));
  ASSERT_EQ(ended.code, 130) << "it should have been stopped: " << read(log);
  EXPECT_NE(read(log).find("the same command continues"), std::string::npos) << read(log);
  EXPECT_FALSE(std::filesystem::exists(folder / "out.clamor"));
}

// Work that cannot be stopped does not keep an interrupted program running.
TEST(StopDeadline, EndsAProgramThatDoesNotEndByItself) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        const Interrupt interrupt;
        const StopDeadline deadline("clamor test: stopped");
        std::raise(SIGINT);
        for (;;) ::pause();
      },
      ::testing::ExitedWithCode(130), "clamor test: stopped");
}

TEST(StopDeadline, LeavesAProgramAloneThatEndsInTime) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        {
          const Interrupt interrupt;
          const StopDeadline deadline("clamor test: stopped");
          std::raise(SIGINT);
        }
        std::this_thread::sleep_for(std::chrono::seconds(2));  // past the deadline
        std::exit(0);
      },
      ::testing::ExitedWithCode(0), "^$");
}

TEST(FullDisk, LeavesOneSentenceNoOutputAndAJournalThatIsSound) {
  const Folder folder;
  const std::string log = folder / "log";
  ASSERT_EQ(run_bake(bake_of(violin_room(), folder / "whole.clamor"), log).code, 0) << read(log);
  const std::string whole = read(folder / "whole.clamor");
  for (const rlim_t most : {0, 10, 1000, 20000, 100000}) {
    const Ended ended = run_bake(bake_of(violin_room(), folder / "out.clamor"), log,
                                 std::chrono::hours(1), SIGKILL, most);
    EXPECT_EQ(ended.code, 1) << most;
    EXPECT_FALSE(std::filesystem::exists(folder / "out.clamor")) << most;
    const std::string words = read(log);
    EXPECT_TRUE(most < 200 || std::count(words.begin(), words.end(), '\n') == 1) << words;
  }
  ASSERT_EQ(run_bake(bake_of(violin_room(), folder / "out.clamor"), log).code, 0) << read(log);
  EXPECT_TRUE(read(folder / "out.clamor") == whole);
  for (const auto& name : folder.names()) EXPECT_EQ(name.find("tmp"), std::string::npos) << name;
}

}  // namespace
}  // namespace clamor
