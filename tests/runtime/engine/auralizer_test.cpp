#include "runtime/engine/auralizer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/sampling/sampler.h"
#include "runtime/sampling/sampling_strategy.h"
#include "runtime/streaming/page_loader.h"
#include "runtime/voices/keyframe.h"
#include "tests/baked_room.h"
#include "tests/sanitized.h"
#include "tests/temporary_file.h"
#include "tests/walks.h"
#include "tools/strategies/strategies.h"

namespace clamor {
namespace {

using testing::baked_room;

Listener walking(double t) { return {{3 + 2 * std::sin(t), 4 + 3 * std::cos(t), 1.5}, 0.7 * t, 0}; }

std::unique_ptr<Auralizer> auralizer_with(int voices, const std::string& strategy = "priority",
                                          AuralizerInput input = baked_room()) {
  AuralizerOptions options;
  options.voices = voices;
  options.strategy = make_strategy(strategy);
  options.block_frames = 2048;
  auto auralizer = Auralizer::create(std::move(input), options);
  EXPECT_TRUE(auralizer.ok());
  return std::move(*auralizer);
}

// Mixes `frames` frames in blocks; next_block() returns the size of each.
template <class NextBlock>
std::vector<float> mixed_blocks(Auralizer& auralizer, std::size_t frames, NextBlock next_block) {
  std::vector<float> out(2 * frames);
  for (std::size_t done = 0; done < frames;) {
    while (auralizer.wants_keyframe())
      auralizer.make_keyframe(walking(auralizer.next_keyframe_time_s()));
    const std::size_t count = std::min<std::size_t>(next_block(), frames - done);
    auralizer.mix({out.data() + 2 * done, 2 * count});
    done += count;
  }
  return out;
}

TEST(Auralizer, RendersTheSameSamplesForAnyBlockSizes_NoTsan) {
  constexpr std::size_t kFrames = testing::kSanitized ? 12000 : 40000;
  const auto regular = mixed_blocks(*auralizer_with(60), kFrames, [] { return 256; });
  std::minstd_rand random(3);
  EXPECT_EQ(regular,
            mixed_blocks(*auralizer_with(60), kFrames, [&] { return 1 + random() % 900; }));
  EXPECT_EQ(regular, mixed_blocks(*auralizer_with(60), kFrames, [] { return 960; }));
  EXPECT_EQ(regular, mixed_blocks(*auralizer_with(60), kFrames, [] { return 1; }));
}

// Pages are evicted and loaded again, yet the output equals that of a level held in memory.
TEST(Auralizer, RendersTheSameSamplesFromAFileWithAlmostNoMemory) {
  const auto file = testing::as_file(testing::baked_contents(4000));
  ASSERT_GT(file->page_count(), 30u);
  AuralizerOptions options;
  options.voices = 60;
  auto input = read_auralizer_input(*file);
  ASSERT_TRUE(input.ok() && read_occluders(*file, *input).ok());
  const auto in_memory = Auralizer::create(std::move(*input), options);
  options.wait_for_pages = true;
  options.memory_bytes = 500'000;
  const auto from_file = Auralizer::create(file, options);
  ASSERT_TRUE(in_memory.ok() && from_file.ok());
  constexpr std::size_t kFrames = 4 * 48000;
  EXPECT_EQ(mixed_blocks(**in_memory, kFrames, [] { return 960; }),
            mixed_blocks(**from_file, kFrames, [] { return 960; }));
  const PageStatistics pages = (*from_file)->statistics().pages;
  EXPECT_GT(pages.dropped, 0u);
  EXPECT_LT(pages.resident, file->page_count() / 2);
  EXPECT_EQ(pages.failed, 0u);
}

AuralizerInput with_occluders(const BakeFile& file) {
  AuralizerInput input;
  EXPECT_TRUE(read_occluders(file, input).ok());
  return input;
}

TEST(Auralizer, SharesTheLevelsSurfacesWithTheOthersOfItsTime) {
  const auto file = testing::as_file(testing::baked_contents(500));
  const auto other = testing::as_file(testing::baked_contents(500));
  auto one = with_occluders(*file);
  EXPECT_EQ(with_occluders(*file).surfaces, one.surfaces);
  EXPECT_NE(with_occluders(*other).surfaces, one.surfaces);
  EXPECT_FALSE(mesh_of(one).triangles.empty());
  const std::weak_ptr<LevelSurfaces> left = one.surfaces;
  one = {};
  EXPECT_TRUE(left.expired());
}

TEST(Auralizer, ReadsTheGeometryOnlyForOcclusion_NoAsan_NoTsan) {
  const testing::TemporaryFile written(".clamor");
  testing::write(testing::baked_contents(500), written);
  const std::string& path = written.path();
  // Finds a byte of the geometry section: the byte whose change only read_mesh() reports.
  std::shared_ptr<const BakeFile> file;
  for (std::uint64_t at = 0; at < std::filesystem::file_size(path); at += 8) {
    std::fstream bytes(path, std::ios::in | std::ios::out | std::ios::binary);
    const auto flip = [&bytes, at] {
      bytes.seekg(static_cast<std::streamoff>(at));
      const auto byte = static_cast<char>(bytes.get() ^ 1);
      bytes.seekp(static_cast<std::streamoff>(at));
      bytes.put(byte).flush();
    };
    flip();
    auto opened = BakeFile::open(path);
    if (opened.ok() && !opened->read_mesh().ok() && read_auralizer_input(*opened).ok()) {
      file = std::make_shared<const BakeFile>(std::move(*opened));
      break;
    }
    flip();
  }
  ASSERT_NE(file, nullptr);
  for (const StrategyInfo& strategy : kStrategies)
    for (const bool visibility : {false, true}) {
      AuralizerOptions options;
      options.strategy = make_strategy(strategy.name);
      options.visibility = visibility;
      const bool looks = visibility && uses_occlusion(strategy.name);
      EXPECT_EQ(Auralizer::create(file, options).ok(), !looks) << strategy.name << visibility;
    }
}

TEST(Auralizer, KeepsItsLoadedPagesWhenTheFileIsTruncated) {
  const testing::TemporaryFile file(".clamor");
  testing::write(testing::baked_contents(4000), file);
  AuralizerOptions options;
  options.voices = 300;
  options.wait_for_pages = true;
  const auto auralizer = Auralizer::create(testing::opened(file), options);
  ASSERT_TRUE(auralizer.ok());
  while ((*auralizer)->statistics().sounds.loaded < 3)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::filesystem::resize_file(file.path(), 100);
  const auto cut = mixed_blocks(**auralizer, 48000, [] { return 960; });
  const PageStatistics pages = (*auralizer)->statistics().pages;
  EXPECT_EQ(pages.loaded, 1u);
  EXPECT_GT(pages.failed, 0u);
  EXPECT_NE(pages.failure.find("cut short while it was open"), std::string::npos) << pages.failure;
  EXPECT_GT(*std::max_element(cut.begin(), cut.end()), 1e-3f);
}

TEST(Auralizer, IsSilentBeforeItsFirstKeyframe_NoTsan) {
  const auto auralizer = auralizer_with(60);
  std::vector<float> block(512, 1.0f);
  auralizer->mix(block);
  EXPECT_EQ(block, std::vector<float>(512, 0.0f));
  EXPECT_EQ(auralizer->statistics().held_blocks, 1u);
}

TEST(Auralizer, HoldsTheLastKeyframeWhileTheSamplerStalls_NoTsan) {
  const Walk still = Walk::standing({{4, 5, 1.6}, 0.4, 0});
  // The signals are steady tones, because the sampler follows changes of level.
  AuralizerInput input = baked_room();
  input.signals.assign(3, testing::sine(440));
  const auto steady = auralizer_with(60, "priority", input),
             stalled = auralizer_with(60, "priority", input);
  std::vector<float> a(512), b(512);
  for (int block = 0; block < 900; ++block) {
    testing::make_keyframes(*steady, still);
    // The stalled sampler makes no keyframe for three seconds.
    if (block < 190 || block > 750) testing::make_keyframes(*stalled, still);
    steady->mix(a);
    stalled->mix(b);
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 1e-5) << "block " << block;
  }
  EXPECT_EQ(steady->statistics().held_blocks, 0u);
  EXPECT_GT(stalled->statistics().held_blocks, 500u);
}

// The listener travels 900 km and back within four seconds, and the sampler stalls for three of
// them. After the return the scene is audible at once, not three seconds of keyframes later.
TEST(Auralizer, FollowsTheClockAfterAStall_NoTsan) {
  const auto pose = [](double t) {
    Listener pose{{4, 5, 1.6}, 0.4, 0};
    if (t >= 1 && t < 5) pose.position_m.x += 450e3 * std::min(t - 1, 5 - t);
    return pose;
  };
  constexpr int kBlock = 480, kBlocks_per_s = kSampleRate_hz / kBlock;
  const auto auralizer = auralizer_with(60);
  std::vector<float> block(2 * kBlock);
  std::vector<double> power;  // per tenth of a second
  double latest_s = 0;
  for (int n = 0; n < 8 * kBlocks_per_s; ++n) {
    const double now_s = static_cast<double>(n) / kBlocks_per_s;
    const bool stands_still = now_s > 1.5 && now_s < 4.5;
    while (!stands_still && auralizer->wants_keyframe()) {
      latest_s = auralizer->next_keyframe_time_s();
      auralizer->make_keyframe(pose(latest_s));
    }
    if (!stands_still) {
      EXPECT_LT(latest_s, now_s + 8 * kKeyframe_s);
      EXPECT_GT(latest_s, now_s) << "the listener keeps an old place";
    }
    auralizer->mix(block);
    if (n % (kBlocks_per_s / 10) == 0) power.push_back(0);
    for (const float sample : block) power.back() += static_cast<double>(sample) * sample;
  }
  EXPECT_GT(auralizer->statistics().held_blocks, 200u);
  double before = 0, away = 0, back = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    before += power[2 + i];
    away += power[12 + i];
    back += power[52 + i];  // starting 0.2 s after the return
  }
  EXPECT_LT(10 * std::log10(away / before), -60);
  EXPECT_NEAR(10 * std::log10(back / before), 0, 2);
}

TEST(Auralizer, StartsAndEndsVoicesWithoutClicks_NoTsan) {
  AuralizerInput input = baked_room();
  input.signals.assign(3, testing::sine(200));
  const auto out = mixed_blocks(*auralizer_with(30, "priority", input), 96000, [] { return 256; });
  // The second difference of a 200 Hz tone is (2 pi 200 / 48000)^2 = 7e-4 of its amplitude, and a
  // gain ramp that changes slope at a keyframe adds 2 / 960. An abrupt start or end of a voice
  // would be a step of a tenth or more.
  float height = 0, bend = 0;
  for (std::size_t i = 4; i < out.size(); i += 2) {
    height = std::max(height, std::abs(out[i]));
    bend = std::max(bend, std::abs(out[i] - 2 * out[i - 2] + out[i - 4]));
  }
  EXPECT_GT(height, 0.01f);
  EXPECT_LT(bend, 0.005f * height);
}

TEST(Auralizer, HasTheSameLevelWithFewVoicesAsWithAll_NoTsan) {
  const auto energy = [](const std::vector<float>& samples) {
    double sum = 0;
    for (const float sample : samples) sum += static_cast<double>(sample) * sample;
    return sum;
  };
  // The signals are noise, because sines interfere by as much as their total power.
  AuralizerInput input = baked_room();
  for (std::uint32_t s = 0; s < input.signals.size(); ++s) {
    input.signals[s].loop = true;
    input.signals[s].samples.resize(24000);
    for (std::uint32_t i = 0; i < 24000; ++i)
      input.signals[s].samples[i] = static_cast<float>(unit(philox(7, {i, s, 0, 0})[0]) - 0.5);
  }
  const double all =
      energy(mixed_blocks(*auralizer_with(1, "all", input), 24000, [] { return 256; }));
  const double few =
      energy(mixed_blocks(*auralizer_with(150, "priority", input), 24000, [] { return 256; }));
  // One standard deviation of the power is 4.34 / sqrt(149) = 0.36 dB.
  EXPECT_NEAR(10 * std::log10(few / all), 0, 3 * 0.36);
}

// With as many voices as sources, a sample that is drawn every third keyframe must sound like
// strategy `all`, which re-evaluates every source in every keyframe.
TEST(Auralizer, FollowsTheListenerWithALargeSampleDrawnLessOften_NoAsan_NoTsan) {
  AuralizerInput input = baked_room(850);
  for (Signal& signal : input.signals) signal.loop = true;
  input.signals[2] = input.signals[0];  // the sampler omits sources while their signal is silent
  ASSERT_GT(input.sources.size(), 2 * kVoicesPerKeyframeOfSample);
  ASSERT_LT(input.sources.size(), 3 * kVoicesPerKeyframeOfSample);
  const auto block = [] { return 960; };
  const auto crowd = mixed_blocks(*auralizer_with(15000, "priority", input), 24000, block);
  const auto all = mixed_blocks(*auralizer_with(15000, "all", input), 24000, block);
  double energy = 0, error = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    energy += std::pow(all[i], 2);
    error += std::pow(static_cast<double>(crowd[i]) - all[i], 2);
  }
  EXPECT_GT(energy, 0);
  // single precision, different order of summation
  EXPECT_LT(10 * std::log10(error / energy), -80);
}

// Samples the first source only.
class FirstSource final : public SamplingStrategy {
 public:
  std::string name() const override { return "first"; }
  bool needs_list() const override { return true; }
  std::unique_ptr<Sampler> make_sampler(const SamplerInput& input) const override {
    return std::make_unique<First>(input.list->page()[0]);
  }

 private:
  class First final : public Sampler {
   public:
    explicit First(const Source& source) { sample_.emplace_back().source = &source; }
    std::span<const SampledSource> sample(const Listener&, double) override { return sample_; }
    bool complete() override { return true; }
    std::size_t capacity() const override { return 1; }

   private:
    std::vector<SampledSource> sample_;
  };
};

TEST(Auralizer, PlaysTheSampleOfAStrategyThatTheApplicationBrings_NoTsan) {
  AuralizerOptions options;
  options.strategy = std::make_shared<const FirstSource>();
  auto auralizer = Auralizer::create(baked_room(), options);
  ASSERT_TRUE(auralizer.ok()) << auralizer.error().message;
  testing::make_keyframes(**auralizer, Walk::standing(walking(0)));
  EXPECT_EQ((*auralizer)->statistics().voices, 1u);
}

TEST(Auralizer, RejectsInvalidOptionsAndInput_NoTsan) {
  AuralizerOptions options;
  options.rays = 0;
  EXPECT_FALSE(Auralizer::create(baked_room(), options).ok());
  options = {};
  options.voices = 0;
  EXPECT_FALSE(Auralizer::create(baked_room(), options).ok());
  options = {};
  options.gain = std::nan("");
  EXPECT_FALSE(Auralizer::create(baked_room(), options).ok());
  AuralizerInput broken = baked_room();
  broken.emitters[0].signal = 99;
  EXPECT_FALSE(Auralizer::create(broken, {}).ok());
}

}  // namespace
}  // namespace clamor
