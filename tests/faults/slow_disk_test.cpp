// Tests that a listener at 50 m/s in a hall that does not fit into memory never waits for a blocked
// disk, and that the counters report what was missing.
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "bake/bake.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_writer.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/streaming/page_loader.h"
#include "tests/faults/fault_injection.h"
#include "tests/rooms.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

namespace {

constexpr double kSpeed_mps = 50;
constexpr std::uint64_t kMemory_bytes = 4'000'000;

// A hall of 160 x 20 x 120 m with 300 000 sources.
const BakeContents& hall() {
  static const BakeContents contents = [] {
    Level level = shoebox({160, 20, 120}, uniform_material(0.2f, 0.5f, 20), {20, 3, 20});
    for (std::uint32_t i = 1; i < 30; ++i) {
      level.emitters.push_back(level.emitters[0]);
      level.emitters[i].position_m = {5.0 * i, 2, 3.0 * i + 10};
    }
    BakeOptions options;
    options.settings.photons = 30'000;
    options.settings.sources = 300'000;
    return *bake(level, options);
  }();
  return contents;
}

// Along the hall and back.
Listener flying(double t) {
  const double way = std::fmod(kSpeed_mps * t, 280);
  return {{10 + (way < 140 ? way : 280 - way), 5, 60}, 0, 0};
}

// Runs the work of the sampler and audio threads for a number of blocks of 20 ms, without a clock.
void fly(Auralizer& auralizer, int blocks) {
  std::vector<float> block(2 * 960);
  for (int i = 0; i < blocks; ++i) {
    while (auralizer.wants_keyframe())
      auralizer.make_keyframe(flying(auralizer.next_keyframe_time_s()));
    auralizer.mix(block);
    for (const float sample : block) ASSERT_TRUE(std::isfinite(sample));
  }
}

TEST(Flight, ThroughALargeHallNeverWaitsForAPageThoughTheDiskStandsStill) {
  const Folder folder;
  const std::string path = folder / "hall.clamor";
  ASSERT_TRUE(write_bake(path, hall(), 2).ok());
  auto opened = BakeFile::open(path);
  ASSERT_TRUE(opened.ok());
  ASSERT_GT(opened->source_count(), 250'000u);
  ASSERT_GT(opened->bytes().pages_unpacked, 5 * kMemory_bytes);
  AuralizerOptions options;
  options.voices = 500;
  options.memory_bytes = kMemory_bytes;
  auto created = Auralizer::create(std::make_shared<const BakeFile>(std::move(*opened)), options);
  ASSERT_TRUE(created.ok());
  Auralizer& auralizer = **created;

  std::atomic<bool> stands_still{true};
  {
    const FaultInjection faults({.folder = folder.path(),
                                 .calls = "pread",
                                 .fail_at_call = 4,
                                 .fate = FaultKind::kRunCallback,
                                 .meanwhile = [&] { stands_still.wait(true); }});
    // Two seconds, or 100 m; a sampler that waits would never finish.
    fly(auralizer, 100);
    const PageStatistics still = auralizer.statistics().pages;
    EXPECT_GT(still.asked, still.loaded);
    EXPECT_LE(still.loaded, 8u);
    EXPECT_GT(still.late, 100u);
    stands_still = false;
    stands_still.notify_all();
  }

  // The disk works again. How many pages arrive depends on the threads.
  PageStatistics pages;
  for (int i = 0; i < 500; ++i) {
    fly(auralizer, 5);
    pages = auralizer.statistics().pages;
    EXPECT_LE(pages.bytes, 2 * kMemory_bytes);
    if (pages.loaded > 50 && pages.dropped > 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_GT(pages.loaded, 20u);
  EXPECT_GT(pages.dropped, 0u);
  EXPECT_GE(pages.asked, pages.loaded);
  EXPECT_EQ(pages.failed, 0u) << pages.failure;
  EXPECT_EQ(auralizer.statistics().held_blocks, 0u);
}

}  // namespace

}  // namespace clamor::testing
