#include "bake/journal/trace_journal.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bake/bake.h"
#include "formats/bake_file/bake_writer.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

using testing::shoebox;
using testing::uniform_material;

class Journal : public ::testing::Test {
 protected:
  Journal() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directory(folder_);
  }
  ~Journal() override { std::filesystem::remove_all(folder_); }

  std::string path() const { return folder_ + "/level.clamor.journal"; }

  static std::string bytes_at(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  static void put_bytes(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }

  // The bytes of a level's bake, with or without a journal, and the number of reused photons.
  std::string bake_bytes(const Level& level, bool with_journal = true) {
    BakeOptions options{.settings = {.photons = 5000, .sources = 2000}, .threads = 2};
    if (with_journal) options.journal = path();
    report_ = {};
    const auto contents = bake(level, options, &report_);
    EXPECT_TRUE(contents.ok()) << contents.error().message;
    if (!contents.ok()) return "";
    const std::string output = folder_ + "/level.clamor";
    EXPECT_TRUE(write_bake(output, *contents, 1).ok());
    return bytes_at(output);
  }

  const std::string folder_ = (std::filesystem::temp_directory_path() /
                               ("clamor_journal_test_" + std::to_string(::getpid())))
                                  .string();
  BakeReport report_;
};

Level fifty_emitters() {
  Level level = shoebox({8, 6, 3}, uniform_material(0.3f, 0.3f, 20), {1, 1, 1});
  level.emitters.resize(50, level.emitters[0]);
  for (std::size_t i = 0; i < 50; ++i) {
    level.emitters[i].name = "emitter" + std::to_string(i);
    level.emitters[i].position_m = {1 + 0.1 * static_cast<double>(i), 2, 1.5};
  }
  return level;
}

TEST_F(Journal, ChangesNoByteAndAvoidsAllTracingTheSecondTime) {
  const Level level = fifty_emitters();
  const std::string without = bake_bytes(level, false);
  EXPECT_TRUE(bake_bytes(level) == without);
  EXPECT_EQ(report_.photons_reused, 0u);
  EXPECT_TRUE(bake_bytes(level) == without);
  EXPECT_EQ(report_.photons_reused, 5000u);
  EXPECT_EQ(report_.journal_warning, "");
}

TEST_F(Journal, MovingOneOfFiftyEmittersTracesThatOneAgain) {
  Level level = fifty_emitters();
  bake_bytes(level);
  level.emitters[20].position_m = {7, 5, 2};
  const std::string found = bake_bytes(level);
  EXPECT_EQ(report_.photons_reused, 4900u);
  EXPECT_TRUE(found == bake_bytes(level, false));
}

TEST_F(Journal, TracesNothingAgainAfterReorderingEmittersOrChangingSignals) {
  Level level = fifty_emitters();
  bake_bytes(level);
  std::swap(level.emitters[3], level.emitters[40]);
  level.signals.push_back(level.signals[0]);
  level.emitters[5].signal = 1;
  const std::string found = bake_bytes(level);
  EXPECT_EQ(report_.photons_reused, 5000u);
  EXPECT_TRUE(found == bake_bytes(level, false));
}

TEST_F(Journal, TracesAgainAfterAChangeOfMaterialWallOrSeed) {
  Level level = fifty_emitters();
  bake_bytes(level);
  level.materials[0].absorption[3] = 0.31f;
  EXPECT_TRUE(bake_bytes(level) == bake_bytes(level, false));
  EXPECT_EQ(report_.photons_reused, 0u);
  level.mesh.vertices_m[0].x -= 0.01f;
  bake_bytes(level);
  EXPECT_EQ(report_.photons_reused, 0u);
}

TEST_F(Journal, ContinuesToTheSameBytesWhereverItWasTruncated) {
  const Level level = fifty_emitters();
  const std::string whole = bake_bytes(level), journal = bytes_at(path());
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> places(0, journal.size() - 1);
  bool some_reused = false;
  for (int i = 0; i < 12; ++i) {
    put_bytes(path(), journal.substr(0, places(random)));
    EXPECT_TRUE(bake_bytes(level) == whole);
    some_reused = some_reused || report_.photons_reused > 0;
  }
  EXPECT_TRUE(some_reused);
  for (const std::size_t size : {0, 1, 15, 16, 17}) {
    put_bytes(path(), journal.substr(0, size));
    EXPECT_TRUE(bake_bytes(level) == whole) << size;
  }
}

TEST_F(Journal, TracesDamagedRecordsAgainAndReportsThem) {
  const Level level = fifty_emitters();
  const std::string whole = bake_bytes(level), journal = bytes_at(path());
  std::string damaged = journal;
  damaged[100] = static_cast<char>(damaged[100] ^ 1);  // in the first record's frame
  put_bytes(path(), damaged);
  EXPECT_TRUE(bake_bytes(level) == whole);
  EXPECT_GT(report_.photons_reused, 0u);
  EXPECT_LT(report_.photons_reused, 5000u);
  EXPECT_NE(report_.journal_warning.find("damaged"), std::string::npos);

  std::mt19937 random(2);
  std::uniform_int_distribution<std::size_t> places(16, journal.size() - 1);
  for (int i = 0; i < 12; ++i) {
    damaged = journal;
    for (int k = 0; k < 3; ++k) damaged[places(random)] ^= static_cast<char>(1 << (k + i % 5));
    put_bytes(path(), damaged);
    EXPECT_TRUE(bake_bytes(level) == whole);
  }
}

TEST_F(Journal, LeavesAFileOfAnotherKindAlone) {
  put_bytes(path(), "this is somebody's diary, and not ours");
  const auto contents = bake(fifty_emitters(), {.journal = path()});
  ASSERT_FALSE(contents.ok());
  EXPECT_NE(contents.error().message.find("no journal"), std::string::npos);
  EXPECT_EQ(bytes_at(path()), "this is somebody's diary, and not ours");
}

TEST_F(Journal, LeavesAShortFileAndAJournalOfAnotherVersionAlone) {
  std::string newer = std::string("CLAMORTJ\x05") + std::string(7, '\0') + "records";
  for (const std::string& foreign : {std::string("short"), std::string("CLAMOR!"), newer}) {
    put_bytes(path(), foreign);
    const auto contents = bake(fifty_emitters(), {.journal = path()});
    ASSERT_FALSE(contents.ok()) << foreign;
    EXPECT_NE(contents.error().message.find(path()), std::string::npos) << contents.error().message;
    EXPECT_NE(contents.error().message.find("left alone"), std::string::npos)
        << contents.error().message;
    EXPECT_EQ(bytes_at(path()), foreign);
  }
}

TEST_F(Journal, RestartsIfACrashTruncatedItsHeader) {
  bake_bytes(fifty_emitters());
  const std::string journal = bytes_at(path());
  for (std::size_t size = 0; size < 16; ++size) {
    put_bytes(path(), journal.substr(0, size));
    EXPECT_TRUE(TraceJournal::open(path(), 1).ok()) << size;
    EXPECT_EQ(bytes_at(path()), journal.substr(0, 16)) << size;
  }
}

TEST_F(Journal, IsRefusedToASecondBakeAtTheSameTime) {
  auto first = TraceJournal::open(path(), 1);
  ASSERT_TRUE(first.ok());
  const auto second = TraceJournal::open(path(), 1);
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find("another bake"), std::string::npos);
}

TEST_F(Journal, DropsRunsThatAreNoLongerNeeded) {
  Level level = fifty_emitters();
  bake_bytes(level);
  const auto size = std::filesystem::file_size(path());
  for (int i = 0; i < 5; ++i) {
    level.materials[0].absorption[0] += 0.01f;
    bake_bytes(level);
  }
  EXPECT_LT(std::filesystem::file_size(path()), 3 * size);
  EXPECT_EQ(report_.journal_bytes, std::filesystem::file_size(path()));
  bake_bytes(level);
  EXPECT_EQ(report_.photons_reused, 5000u);
}

}  // namespace
}  // namespace clamor
