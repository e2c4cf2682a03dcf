#include "tools/view/progressive_bake.h"

#include <chrono>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

#include "formats/bake_file/bake_file.h"
#include "tests/box_level.h"
#include "tests/tools/run_clamor.h"
#include "tools/commands/watched_bake.h"

namespace clamor::testing {
namespace {

class ProgressiveBakeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    request_.level_path = box_level(folder_);
    request_.import.emitters = {"name=hiss,signal=noise,at=1,1,1"};
    request_.import.material = "brick";
    request_.photons = "4000";
    request_.sources = "3000";
  }

  static ProgressiveBake::News next(ProgressiveBake& bake) {
    for (;;) {  // CTest ends a test that waits for ever
      if (auto news = bake.poll()) return *news;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  const Folder folder_;
  BakeRequest request_;
};

TEST_F(ProgressiveBakeTest, EndsWithTheBytesOfClamorBake) {
  const std::string ours = folder_ / "ours.clamor", theirs = folder_ / "theirs.clamor";
  ProgressiveBake bake(1);
  ASSERT_TRUE(bake.start().ok());
  bake.request(request_, ours);
  const auto quick = next(bake);
  EXPECT_EQ(quick.stage, "quick");
  EXPECT_FALSE(quick.is_final);
  const auto first = BakeFile::open(quick.path);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first->settings().photons, 1000u);
  const auto last = next(bake);
  ASSERT_TRUE(last.is_final) << last.error;
  EXPECT_EQ(last.path, ours);
  ASSERT_EQ(clamor({"bake", request_.level_path, "-o", theirs, "--quiet", "--emitter",
                    request_.import.emitters[0], "--material", "brick", "--photons", "4000",
                    "--sources", "3000"})
                .code,
            0);
  EXPECT_TRUE(read(ours) == read(theirs));
}

TEST_F(ProgressiveBakeTest, TellsOnlyOfTheNewestRequest) {
  ProgressiveBake bake(1);
  ASSERT_TRUE(bake.start().ok());
  bake.request(request_);
  BakeRequest other = request_;
  other.import.material = "carpet";
  const std::uint64_t newest = bake.request(other);
  for (bool is_final = false; !is_final;) {
    const auto news = next(bake);
    ASSERT_EQ(news.error, "");
    EXPECT_EQ(news.request, newest);
    const auto file = BakeFile::open(news.path);
    ASSERT_TRUE(file.ok());
    is_final = news.is_final;
  }
  EXPECT_FALSE(bake.status().is_busy);
}

TEST_F(ProgressiveBakeTest, TellsErrorsAndGoesOn) {
  ProgressiveBake bake(1);
  ASSERT_TRUE(bake.start().ok());
  BakeRequest wrong = request_;
  wrong.level_path = folder_ / "missing.gltf";
  bake.request(wrong);
  EXPECT_NE(next(bake).error, "");
  bake.request(request_);
  EXPECT_EQ(next(bake).error, "");
}

TEST_F(ProgressiveBakeTest, LeavesNoFilesBehind) {
  std::string path;
  {
    ProgressiveBake bake(1);
    ASSERT_TRUE(bake.start().ok());
    bake.request(request_);
    path = next(bake).path;
    EXPECT_TRUE(std::filesystem::exists(path));
  }
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::path(path).parent_path()));
}

TEST(BakeStages, GrowUnlessTheRequestIsSmall) {
  BakeRequest request;
  EXPECT_EQ(stages_of(request).size(), 3u);
  request.photons = "500";
  ASSERT_EQ(stages_of(request).size(), 1u);
  EXPECT_EQ(stages_of(request)[0].request.photons, "500");
}

TEST(FilesWatcherTest, ReportsAChangeOnceItHasSettled) {
  const Folder folder;
  const std::string level = folder.write("a.gltf", "one"), sidecar = folder / "a.json";
  const std::vector<std::string> paths{level, sidecar};
  FilesWatcher watcher;
  watcher.add(paths);
  EXPECT_FALSE(watcher.check());
  folder.write("a.gltf", "longer");
  EXPECT_FALSE(watcher.check()) << "it may still be being written";
  EXPECT_TRUE(watcher.check());
  EXPECT_FALSE(watcher.check()) << "each change once";
  folder.write("a.json", "{}");
  (void)watcher.check();
  EXPECT_TRUE(watcher.check()) << "a file that was not there";
  std::filesystem::remove(sidecar);
  (void)watcher.check();
  EXPECT_TRUE(watcher.check()) << "a file that is gone";
}

TEST(WatchedBake, CannotBeCombinedWithOptionsOfOneBake) {
  const auto refused = clamor({"bake", "a.glb", "-o", "a.clamor", "--watch", "--until", "5s"});
  EXPECT_EQ(refused.code, 2);
}

}  // namespace
}  // namespace clamor::testing
