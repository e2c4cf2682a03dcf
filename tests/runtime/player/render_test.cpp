// render_test.cpp: rendering with two threads, against one thread that makes keyframes and mixes in
// turn.
#include "runtime/player/render.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/voices/keyframe.h"
#include "tests/baked_room.h"
#include "tests/runtime/instruction_sets.h"
#include "tests/runtime/two_rooms.h"
#include "tests/sanitized.h"
#include "tests/walks.h"
#include "tools/strategies/strategies.h"

namespace clamor {
namespace {

using testing::across_the_room;
using testing::baked_room;

std::unique_ptr<Auralizer> auralizer_of(const AuralizerOptions& options) {
  auto auralizer = Auralizer::create(baked_room(), options);
  EXPECT_TRUE(auralizer.ok());
  return std::move(*auralizer);
}

std::vector<float> in_turn(const AuralizerOptions& options, const Walk& walk,
                           std::uint64_t frames) {
  const auto auralizer = auralizer_of(options);
  const auto channels = static_cast<std::uint64_t>(auralizer->channels());
  std::vector<float> all(frames * channels);
  for (std::uint64_t done = 0; done < frames; done += kKeyframeFrames) {
    testing::make_keyframes(*auralizer, walk);
    const auto count = std::min<std::uint64_t>(kKeyframeFrames, frames - done);
    auralizer->mix(std::span(all).subspan(done * channels, count * channels));
  }
  return all;
}

BlockSink appending_to(std::vector<float>& all) {
  return [&all](std::span<const float> block) {
    all.insert(all.end(), block.begin(), block.end());
    return Result<void>();
  };
}

TEST(Render, EqualsOneThreadThatMakesKeyframesAndMixesInTurn) {
  const Walk walk = across_the_room();
  for (const char* strategy : {"priority", "all"})
    for (const bool limit : {false, true})
      for (const int block_frames : {1, 960, 5000}) {
        const bool all = strategy == std::string("all");
        // The threads hand over the same things whatever the strategy and the limiter do.
        if (all && limit) continue;
        if (testing::kSanitized && (all || limit)) continue;
        const std::uint64_t frames = 6'007;
        AuralizerOptions options;
        options.strategy = make_strategy(strategy);
        options.voices = 100;
        options.limit = limit;
        options.block_frames = block_frames;
        const auto auralizer = auralizer_of(options);
        std::vector<float> rendered;
        ASSERT_TRUE(render(*auralizer, walk, frames, appending_to(rendered)).ok());
        EXPECT_EQ(auralizer->statistics().held_blocks, 0u);
        EXPECT_EQ(rendered, in_turn(options, walk, frames)) << strategy << " limit " << limit;
      }
}

TEST(Render, ContinuesWhereItEnded) {
  const Walk walk = across_the_room();
  AuralizerOptions options;
  options.voices = 100;
  const auto auralizer = auralizer_of(options);
  std::vector<float> rendered;
  for (const std::uint64_t frames : {9'600u, 0u, 960u, 19'200u})
    ASSERT_TRUE(render(*auralizer, walk, frames, appending_to(rendered)).ok());
  EXPECT_EQ(rendered, in_turn(options, walk, rendered.size() / 2));
}

// Sums have other orders and roundings with each instruction set, but what is chosen and what
// occludes it is the same: one ray that is decided otherwise gives -70 dB.
TEST(Render, DiffersByRoundingAloneBetweenInstructionSets_NoAsan) {
  const testing::KernelGuard guard;
  const testing::World rooms(testing::two_rooms(true), 300);
  const BakeContents& baked = rooms.contents;
  const Walk walk = across_the_room();
  std::vector<float> first;
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    AuralizerInput input{baked.octree.sources, baked.emitters, baked.signals, baked.materials,
                         baked.settings.air};
    input.mesh = baked.mesh;
    AuralizerOptions options;
    options.voices = 100;
    options.wait_for_pages = true;
    const auto auralizer = Auralizer::create(std::move(input), options);
    ASSERT_TRUE(auralizer.ok());
    std::vector<float> rendered;
    ASSERT_TRUE(render(**auralizer, walk, 24'000, appending_to(rendered)).ok());
    if (first.empty()) first = rendered;
    ASSERT_EQ(rendered.size(), first.size());
    double power = 0, difference = 0;
    for (std::size_t i = 0; i < first.size(); ++i) {
      power += std::pow(first[i], 2);
      difference += std::pow(rendered[i] - first[i], 2);
    }
    ASSERT_GT(power, 0);
    EXPECT_LT(10 * std::log10(difference / power), -110) << target;
  }
}

// Before, the number of voices that a render prints was that of some keyframe after its end.
TEST(Render, HasTheSameStatisticsHoweverFarAheadKeyframesCouldBeMade) {
  constexpr std::uint64_t kFrames = 6 * kKeyframeFrames + 7;
  AuralizerOptions options;
  options.voices = 100;
  std::vector<std::uint32_t> voices;
  for (const int block_frames : {960, 60'000}) {
    options.block_frames = block_frames;  // for which so many keyframes may wait
    const auto auralizer = auralizer_of(options);
    std::vector<float> rendered;
    ASSERT_TRUE(render(*auralizer, across_the_room(), kFrames, appending_to(rendered)).ok());
    // Seven blocks lie between eight keyframes, and the filters look ahead to one more.
    EXPECT_EQ(auralizer->statistics().keyframes, 9u);
    voices.push_back(auralizer->statistics().voices);
  }
  EXPECT_EQ(voices[0], voices[1]);
}

TEST(Render, ReturnsTheErrorOfItsSink) {
  AuralizerOptions options;
  options.voices = 100;
  const auto auralizer = auralizer_of(options);
  int blocks = 0;
  const auto rendered =
      render(*auralizer, across_the_room(), 48'000'000, [&](std::span<const float>) {
        return ++blocks == 3 ? Result<void>(Error("the disk is full.")) : Result<void>();
      });
  ASSERT_FALSE(rendered.ok());
  EXPECT_EQ(rendered.error().message, "the disk is full.");
  EXPECT_EQ(blocks, 3);
}

}  // namespace
}  // namespace clamor
