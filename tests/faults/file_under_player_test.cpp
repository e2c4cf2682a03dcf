// Tests that the sound continues at the same loudness when the file that is played fails.
#include <cmath>
#include <cstring>

#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/player/render.h"
#include "runtime/streaming/page_loader.h"
#include "tests/faults/fault_injection.h"
#include "tests/faults/file_faults.h"
#include "tests/sanitized.h"

namespace clamor::testing {

namespace {

struct Playback {
  double energy = 0;
  PageStatistics pages;
};

constexpr int kKeyframes = kSanitized ? 60 : 100;

// Walks through the room for up to two seconds with almost no memory, so that pages are loaded and
// evicted. The fault happens after half a second.
Playback walked(const std::string& path, const std::function<void()>& strike,
                FileAccess access = FileAccess::kRead) {
  auto file = BakeFile::open(path, access);
  EXPECT_TRUE(file.ok());
  AuralizerOptions options;
  options.voices = 300;
  options.wait_for_pages = true;
  options.memory_bytes = 300'000;
  auto auralizer = Auralizer::create(std::make_shared<const BakeFile>(std::move(*file)), options);
  EXPECT_TRUE(auralizer.ok());
  Playback played;
  std::vector<float> block(2 * 960);
  for (int i = 0; i < kKeyframes; ++i) {
    if (i == 25) strike();
    while ((*auralizer)->wants_keyframe()) {
      const double t = (*auralizer)->next_keyframe_time_s();
      (*auralizer)
          ->make_keyframe({{3 + 2.5 * std::sin(3 * t), 4 + 3 * std::cos(3 * t), 1.5}, t, 0});
    }
    (*auralizer)->mix(block);
    const double energy = energy_of(block);
    EXPECT_TRUE(std::isfinite(energy));
    if (i >= 25) played.energy += energy;
  }
  played.pages = (*auralizer)->statistics().pages;
  return played;
}

TEST(FileUnderAPlayer, MayBeCutOverwrittenReplacedOrDeletedAndSoundsAsLoudAsBefore) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const std::string whole = read(path);
  const Playback undisturbed = walked(path, [] {});
  ASSERT_GT(undisturbed.pages.dropped, 20u);  // pages are read again
  for (const FileAccess access : {FileAccess::kRead, FileAccess::kMap})
    for (const FileFault& fault : file_faults()) {
      std::ofstream(path, std::ios::binary) << whole;
      const Playback played = walked(
          path, [&] { fault.strike(path); }, access);
      EXPECT_EQ(played.pages.failed > 0, fault.is_noticed) << fault.what;
      EXPECT_EQ(played.pages.failure.find(path) == 0, fault.is_noticed) << played.pages.failure;
      // The pages in memory represent the rest: unbiased, with a spread of 0.8 dB for one page.
      EXPECT_NEAR(10 * std::log10(played.energy / undisturbed.energy), 0,
                  fault.is_noticed ? 2.5 : 1e-9)
          << fault.what;
    }
}

TEST(FileUnderAPlayer, WhoseDiskFailsSoundsAsLoudAsBefore_NoAsan) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const Playback undisturbed = walked(path, [] {});
  for (const long at : {20, 80}) {
    if (kSanitized && at != 20) continue;  // slow
    for (const FaultKind fate : {FaultKind::kFails, FaultKind::kPersistentFailure}) {
      const FaultInjection faults({.folder = folder.path(),
                                   .calls = "pread",
                                   .thread = kPageLoader,
                                   .fail_at_call = at,
                                   .fate = fate,
                                   .error = EIO});
      const Playback played = walked(path, [] {});
      EXPECT_TRUE(faults.struck());
      EXPECT_EQ(played.pages.failed, fate == FaultKind::kFails ? 1u : played.pages.failed);
      EXPECT_NE(played.pages.failure.find(std::strerror(EIO)), std::string::npos)
          << played.pages.failure;
      EXPECT_NEAR(10 * std::log10(played.energy / undisturbed.energy), 0, 2.5) << at;
    }
  }
  // Interrupted and short reads are no failures.
  for (const FaultKind fate : {FaultKind::kFails, FaultKind::kPartialTransfer}) {
    const FaultInjection faults({.folder = folder.path(),
                                 .calls = "pread",
                                 .thread = kPageLoader,
                                 .fail_at_call = 40,
                                 .fate = fate,
                                 .error = EINTR});
    const Playback played = walked(path, [] {});
    EXPECT_TRUE(faults.struck());
    EXPECT_EQ(played.pages.failed, 0u);
    EXPECT_EQ(played.energy, undisturbed.energy);
  }
}

// A mapped page that the disk cannot deliver raises SIGBUS, as does one beyond the end of the file;
// reading it then gives the reason.
TEST(FileUnderAPlayer, WhoseDiskFailsUnderAMappingSoundsAsLoudAsBefore_NoAsan) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const Playback undisturbed = walked(path, [] {});
  const FaultInjection faults({.folder = folder.path(),
                               .calls = "pread",
                               .thread = kPageLoader,
                               .fail_at_call = 0,
                               .fate = FaultKind::kPersistentFailure,
                               .error = EIO});
  EXPECT_EQ(walked(
                path, [] {}, FileAccess::kMap)
                .energy,
            undisturbed.energy);
  EXPECT_FALSE(faults.struck());  // no read that could be intercepted
  const Playback played = walked(
      path, [&] { std::filesystem::resize_file(path, 0); }, FileAccess::kMap);
  EXPECT_TRUE(faults.struck());
  EXPECT_GT(played.pages.failed, 0u);
  EXPECT_NE(played.pages.failure.find(std::strerror(EIO)), std::string::npos)
      << played.pages.failure;
  EXPECT_NEAR(10 * std::log10(played.energy / undisturbed.energy), 0, 2.5);
}

}  // namespace

}  // namespace clamor::testing
