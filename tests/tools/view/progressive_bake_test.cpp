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

  static ProgressiveBake::Event next(ProgressiveBake& bake) {
    for (;;) {  // CTest ends a test that waits for ever
      if (auto event = bake.poll()) return *event;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  const Folder folder_;
  BakeRequest request_;
};

TEST_F(ProgressiveBakeTest, EndsWithTheBytesOfClamorBake_NoAsan) {
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

// An edit of the walls, as the window asks for it.
BakeRequest with_walls(BakeRequest request, const Folder& folder, const std::string& values) {
  request.import.material.reset();
  request.import.sidecar = folder.write("edit.json", R"({"materials": {"*": {)" + values + "}}}");
  return request;
}

TEST_F(ProgressiveBakeTest, ReweighsPhotonsWhenOnlyAbsorptionChanges_NoAsan) {
  const std::string ours = folder_ / "ours.clamor", theirs = folder_ / "theirs.clamor";
  request_.photons = "24100";
  request_.sources = "30000";
  ProgressiveBake bake(1);
  ASSERT_TRUE(bake.start().ok());
  const auto edit = [&](const std::string& walls) {
    bake.cancel();  // the stage before may be about to read the file that is written now
    const auto number = bake.request(with_walls(request_, folder_, walls), ours);
    for (;;)  // the last stage of the request before may have ended already
      if (const auto event = next(bake); event.request == number) return event;
  };
  const auto first = edit(R"("absorption": 0.3, "scattering": 0.5)");
  EXPECT_EQ(first.stage, "quick");
  EXPECT_EQ(first.why_traced, "no complete bake has kept its paths");
  ASSERT_EQ(next(bake).stage, "better");
  for (const char* const absorption : {"0.35", "[0.3, 0.3, 0.35, 0.35, 0.4, 0.4, 0.3, 0.3]"}) {
    const auto edited = edit(R"("scattering": 0.5, "absorption": )" + std::string(absorption));
    EXPECT_EQ(edited.error, "");
    EXPECT_TRUE(edited.is_reweighed) << edited.why_traced;
    EXPECT_EQ(edited.stage, "re-weighed");
  }
  // The last bake is not re-weighed, although surfaces and sounds come from the cache.
  const auto last = next(bake);
  EXPECT_TRUE(last.is_final);
  EXPECT_FALSE(last.is_reweighed);
  ASSERT_EQ(clamor({"bake", request_.level_path, "-o", theirs, "--quiet", "--emitter",
                    request_.import.emitters[0], "--acoustics", folder_ / "edit.json", "--photons",
                    "24100", "--sources", "30000"})
                .code,
            0);
  EXPECT_FALSE(read(ours).empty());
  EXPECT_TRUE(read(ours) == read(theirs));
  const auto rougher = edit(R"("absorption": 0.35, "scattering": 0.6)");
  EXPECT_FALSE(rougher.is_reweighed);
  EXPECT_EQ(rougher.why_traced, "more than absorption has changed");
}

TEST_F(ProgressiveBakeTest, TellsOnlyOfTheNewestRequest_NoAsan) {
  ProgressiveBake bake(1);
  ASSERT_TRUE(bake.start().ok());
  bake.request(request_);
  BakeRequest other = request_;
  other.import.material = "carpet";
  const std::uint64_t newest = bake.request(other);
  for (bool is_final = false; !is_final;) {
    const auto event = next(bake);
    ASSERT_EQ(event.error, "");
    EXPECT_EQ(event.request, newest);
    const auto file = BakeFile::open(event.path);
    ASSERT_TRUE(file.ok());
    is_final = event.is_final;
  }
  EXPECT_FALSE(bake.status().is_busy);
}

TEST_F(ProgressiveBakeTest, TellsErrorsAndGoesOn_NoAsan) {
  ProgressiveBake bake(1);
  ASSERT_TRUE(bake.start().ok());
  BakeRequest wrong = request_;
  wrong.level_path = folder_ / "missing.gltf";
  bake.request(wrong);
  EXPECT_NE(next(bake).error, "");
  bake.request(request_);
  EXPECT_EQ(next(bake).error, "");
}

TEST_F(ProgressiveBakeTest, LeavesNoFilesBehind_NoAsan) {
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
