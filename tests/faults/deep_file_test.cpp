// Tests that files with very deeply nested instances are read and played without recursion.
#include <atomic>
#include <cmath>
#include <memory>

#include "bake/instances/instance_tree.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_writer.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/player/render.h"
#include "tests/baked_room.h"
#include "tests/sanitized.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

namespace {

// A room in a tree, which the next tree instances several times in one place, and so on.
BakeContents nested(std::uint32_t depth, std::uint32_t copies) {
  BakeContents bake = baked_contents(60);
  for (Signal& signal : bake.signals) signal.samples.resize(200, 0.25f);
  std::vector<PageEntry> tops;
  for (std::uint32_t t = 0; t < depth; ++t) {
    tops.push_back(root_entry(bake.octree, tops));
    bake.prototypes.push_back(std::move(bake.octree));
    OctreeNode node;
    node.low_m = tops.back().low_m;
    node.high_m = tops.back().high_m;
    node.instance_count = copies;
    bake.octree = {};
    bake.octree.instances.assign(copies, Instance{.tree = t});
    include_instances(bake.octree.instances, tops, node);
    bake.octree.nodes = {node};
  }
  return bake;
}

// Reads every page of the file and plays a few blocks of it. Returns the number of sources that it
// claims.
std::uint64_t read_and_play(const BakeContents& bake) {
  const Folder folder;
  const std::string path = folder / "deep.clamor";
  const auto written = write_bake(path, bake, 1);
  EXPECT_TRUE(written.ok()) << (written.ok() ? "" : written.error().message);
  auto opened = BakeFile::open(path);
  EXPECT_TRUE(opened.ok()) << (opened.ok() ? "" : opened.error().message);
  if (!opened.ok()) return 0;
  const auto file = std::make_shared<const BakeFile>(std::move(*opened));
  std::uint64_t pages = 0;
  EXPECT_TRUE(file->for_each_page([&](const PageEntry&, const OctreePage&, std::size_t,
                                      std::size_t) -> Result<void> {
                    ++pages;
                    return {};
                  })
                  .ok());
  EXPECT_EQ(pages, file->page_count());

  AuralizerOptions options;
  options.voices = 50;
  options.visibility = false;
  options.wait_for_pages = true;
  const auto auralizer = Auralizer::create(file, options);
  if (!auralizer.ok()) return file->source_count();  // refused with a sentence
  std::vector<float> block(2 * 960);
  for (int k = 0; k < (kSanitized ? 1 : 3); ++k) {
    while ((*auralizer)->wants_keyframe())
      (*auralizer)->make_keyframe({{3 + 0.1 * k, 4, 1.5}, 0, 0});
    (*auralizer)->mix(block);
    for (const float sample : block) EXPECT_TRUE(std::isfinite(sample));
  }
  return file->source_count();
}

TEST(DeepFile, OfCopiesWithinThousandsOfCopiesIsReadAndPlayedWithoutHarm) {
  const std::uint32_t depth = kSanitized ? 2'000 : 20'000;
  EXPECT_GT(read_and_play(nested(depth, 1)), 60u);
}

// Billions of equal sources: no threshold separates a few of them from the others.
TEST(DeepFile, WhoseCopiesDoubleThirtyFiveTimesIsPlayedWithoutEndlessSearch) {
  EXPECT_GT(read_and_play(nested(35, 2)), 1e12);
}

// A keyframe takes seconds, and a render has thousands, so rendering must check the stop flag
// itself.
TEST(DeepFile, WhoseCopiesAreBeyondNumberIsNotRenderedOnceThatIsStopped) {
  const Folder folder;
  const std::string path = folder / "deep.clamor";
  ASSERT_TRUE(write_bake(path, nested(12, 8), 1).ok());
  auto file = BakeFile::open(path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  const std::atomic<bool> stop = true;
  AuralizerOptions options;
  options.wait_for_pages = true;
  options.stop = &stop;
  const auto auralizer =
      Auralizer::create(std::make_shared<const BakeFile>(std::move(*file)), options);
  ASSERT_TRUE(auralizer.ok()) << auralizer.error().message;
  int blocks = 0;
  const auto rendered = render(
      **auralizer, Walk::standing({{3, 4, 1.5}, 0, 0}), std::uint64_t{kSampleRate_hz} * 3600,
      [&](std::span<const float>) {
        ++blocks;
        return Result<void>();
      },
      &stop);
  ASSERT_FALSE(rendered.ok());
  EXPECT_EQ(blocks, 0);
}

}  // namespace

}  // namespace clamor::testing
