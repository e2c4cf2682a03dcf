// Tests that if any system call of writing fails, in any way, the user reads a sentence, keeps the
// older file, and can run the command again.
#include <cstring>
#include <set>
#include <sstream>
#include <string>

#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_writer.h"
#include "tests/baked_room.h"
#include "tests/box_level.h"
#include "tests/faults/fault_injection.h"
#include "tests/sanitized.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

namespace {

struct Kind {
  const char* what;
  FaultKind fate;
  int error;
};

// EINTR and a short read or write are no errors.
constexpr Kind kKinds[] = {{"the disk is full from then on", FaultKind::kPersistentFailure, ENOSPC},
                           {"one call is an I/O error", FaultKind::kFails, EIO},
                           {"one call is interrupted", FaultKind::kFails, EINTR},
                           {"one call does half", FaultKind::kPartialTransfer, 0}};

// Sanitizers make this ten times slower, so they test every sixth call.
constexpr long kStride = kSanitized ? 6 : 1;

// Warnings about the level do not depend on the disk.
std::size_t lines_besides_warnings(const std::string& text) {
  std::istringstream lines(text);
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line);) count += !line.starts_with("  warning  ");
  return count;
}

bool harmless(const Kind& kind) {
  return kind.error == EINTR || kind.fate == FaultKind::kPartialTransfer;
}

const BakeContents& large() {
  static const BakeContents contents = baked_contents(kSanitized ? 30 : 100);
  return contents;
}

TEST(WriteBake, SyncsTheFileThenRenamesItThenSyncsTheFolder) {
  const Folder folder;
  const FaultInjection faults({.folder = folder.path()});
  ASSERT_TRUE(write_bake(folder / "a.clamor", large(), 1).ok());
  std::vector<std::string> log = faults.log();
  const auto first = [&](const std::string& beginning) {
    return std::find_if(log.begin(), log.end(),
                        [&](const std::string& line) { return line.starts_with(beginning); });
  };
  const auto rename = first("rename a.clamor"), folder_opened = first("open-folder");
  const auto file_sync = first("fsync a.clamor."), last_write = first("pwrite a.clamor.");
  ASSERT_TRUE(rename != log.end() && folder_opened != log.end());
  EXPECT_EQ(count_of(log, "rename"), 1);
  EXPECT_EQ(count_of(log, "fsync"), 2);
  EXPECT_LT(last_write, file_sync);  // the preamble is written last
  EXPECT_LT(file_sync, rename);
  EXPECT_LT(rename, folder_opened);
  ASSERT_NE(folder_opened + 1, log.end());
  EXPECT_TRUE((folder_opened + 1)->starts_with("fsync ")) << *(folder_opened + 1);
}

TEST(WriteBake, AtEveryCallThatFailsLeavesTheOlderFileOrTheNewOneWholeAndNothingElse) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, baked_contents(20), 1).ok());
  const std::string older = read(path);
  ASSERT_TRUE(write_bake(path, large(), 1).ok());
  const std::string newer = read(path);
  for (const Kind& kind : kKinds) {
    long n = 0, refused = 0;
    for (bool struck = true; struck; n += kStride) {
      std::ofstream(path, std::ios::binary) << older;
      Result<void> done;
      bool after_rename = false;
      {
        const FaultInjection faults(
            {.folder = folder.path(), .fail_at_call = n, .fate = kind.fate, .error = kind.error});
        done = write_bake(path, large(), 1);
        struck = faults.struck();
        // After the rename come closing the file and opening, syncing and closing the folder.
        auto before = faults.log();
        if (struck) before.resize(static_cast<std::size_t>(n));
        after_rename = struck && count_of(before, "rename") > 0;
      }
      const std::string where = kind.what + (" at call " + std::to_string(n));
      EXPECT_EQ(folder.names(), std::vector<std::string>{"a.clamor"}) << where;
      if (done.ok()) {
        EXPECT_TRUE(!struck || harmless(kind) || after_rename) << where;
        ASSERT_TRUE(read(path) == newer) << where;
      } else {
        ++refused;
        EXPECT_FALSE(harmless(kind)) << where << ": " << done.error().message;
        EXPECT_EQ(done.error().message.find(path), 0u) << done.error().message;
        EXPECT_NE(done.error().message.find(std::strerror(kind.error)), std::string::npos)
            << done.error().message;
        ASSERT_TRUE(read(path) == older) << where;
      }
      ASSERT_LT(n, 1000);
    }
    EXPECT_GT(n, 10) << kind.what;
    // All calls but four, plus the round without a fault.
    if (!kSanitized) {
      EXPECT_EQ(refused, harmless(kind) ? 0 : n - 5) << kind.what;
    }
  }
}

TEST(Recording, WhoseDiskFailsAtAnyCallCanBePlayedUpToThere) {
  const Folder folder;
  const std::string path = folder / "r.wav";
  constexpr std::size_t kBlocks = 10, kFrames = 960;
  for (const Kind& kind : kKinds) {
    long n = 0;
    for (bool struck = true; struck; n += kStride) {
      folder.write("r.wav", "an older recording");
      std::size_t taken = 0;
      std::string why;
      {
        const FaultInjection faults(
            {.folder = folder.path(), .fail_at_call = n, .fate = kind.fate, .error = kind.error});
        auto writer =
            WavWriter::create(path, 2, 48000, SampleFormat::kPcm16, {}, Appearance::kAtOnce);
        Result<void> done = writer.ok() ? Result<void>() : Result<void>(writer.error());
        for (std::size_t block = 0; block < kBlocks && done.ok(); ++block) {
          done = writer->write(std::vector<float>(2 * kFrames, 0.25f));
          if (done.ok()) ++taken;
        }
        if (done.ok()) done = writer->finish();
        if (!done.ok()) why = done.error().message;
        struck = faults.struck();
      }
      const std::string where = kind.what + (" at call " + std::to_string(n)) + ": " + why;
      EXPECT_EQ(folder.names(), std::vector<std::string>{"r.wav"}) << where;
      if (!why.empty()) {
        EXPECT_FALSE(harmless(kind)) << where;
        EXPECT_NE(why.find(std::strerror(kind.error)), std::string::npos) << where;
      } else {
        EXPECT_EQ(taken, kBlocks) << where;
      }
      if (taken == 0) {
        // The first block may have been written before the failure.
        EXPECT_TRUE(read(path) == "an older recording" || read(path).starts_with("RIFF")) << where;
      } else {
        const auto sound = read_channels(path, 2);
        ASSERT_TRUE(sound.ok()) << where << sound.error().message;
        EXPECT_GE(sound->frames(), taken * kFrames) << where;
        EXPECT_EQ(why.empty() || why.find("what was written before is kept") != std::string::npos,
                  taken < kBlocks || why.empty())
            << where;
      }
      ASSERT_LT(n, 1000);
    }
    EXPECT_GT(n, 20) << kind.what;
  }
}

std::vector<std::string> bake_of(const std::string& level, const Folder& folder,
                                 const std::string& output) {
  return {"bake",      level,
          "-o",        folder / output,
          "--photons", "600",
          "--sources", "600",
          "--emitter", "name=click,signal=impulse,at=1,1.2,1",
          "--longest", "0.05",
          "--threads", "1",
          "--quiet"};
}

// Files that a run of the command left behind, except the journal.
void expect_nothing_but(const Folder& folder, const std::set<std::string>& expected,
                        const std::string& where) {
  for (const std::string& name : folder.names())
    EXPECT_TRUE(expected.contains(name)) << name << ": " << where;
}

// Runs the command with each call failing in turn, each time followed by an undisturbed run.
void fail_everywhere(const std::vector<std::string>& more, bool is_journal,
                     std::span<const Kind> kinds) {
  const Folder levels, whole_folder, folder;
  const std::string level = box_level(levels), output = is_journal ? "out.shard" : "out.clamor";
  const auto command = [&](const Folder& to) {
    auto words = bake_of(level, to, output);
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  ASSERT_EQ(clamor(command(whole_folder)).code, 0);
  const std::string whole = read(whole_folder / output);
  const std::string older = "an older file, which need not be a bake";
  for (const Kind& kind : kinds) {
    long n = 0;
    int failures = 0;
    for (bool struck = true; struck; n += kStride) {
      for (const std::string& name : folder.names()) std::filesystem::remove(folder / name);
      if (!is_journal) folder.write(output, older);
      Outcome outcome;
      std::vector<std::string> log;
      {
        const FaultInjection faults(
            {.folder = folder.path(), .fail_at_call = n, .fate = kind.fate, .error = kind.error});
        outcome = clamor(command(folder));
        struck = faults.struck();
        log = faults.log();
      }
      const std::string where = kind.what + (" at call " + std::to_string(n)) + "\n" + outcome.err;
      expect_nothing_but(folder, {output, output + ".journal"}, where);
      if (outcome.code == 0) {
        ASSERT_TRUE(read(folder / output) == whole) << where;
        continue;
      }
      ++failures;
      EXPECT_EQ(outcome.code, 1) << where;
      EXPECT_FALSE(harmless(kind)) << where;
      EXPECT_EQ(lines_besides_warnings(outcome.err), 1u) << where;
      EXPECT_NE(outcome.err.find(folder / output), std::string::npos) << where;
      EXPECT_NE(outcome.err.find(std::strerror(kind.error)), std::string::npos) << where;
      ASSERT_TRUE(is_journal || read(folder / output) == older) << where;
      // Whatever was kept, the same command then ends in the same bytes.
      ASSERT_EQ(clamor(command(folder)).code, 0) << where;
      ASSERT_TRUE(read(folder / output) == whole) << where;
      ASSERT_LT(n, 1000);
    }
    EXPECT_EQ(failures > (kSanitized ? 0 : 3), !harmless(kind)) << kind.what << ": " << failures;
  }
}

TEST(BakeCommand, WhoseDiskFailsAtAnyCallSaysSoKeepsTheOlderFileAndGoesOnLater) {
  fail_everywhere({}, false, std::span(kKinds).first(2));
}

TEST(BakeCommand, OfAShardWhoseDiskFailsAtAnyCallSaysSoAndGoesOnLater) {
  fail_everywhere({"--shard", "1/2"}, true, std::span(kKinds).first(2));
}

}  // namespace

}  // namespace clamor::testing
