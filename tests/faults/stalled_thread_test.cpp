// Tests a sampler or loader that stalls for ten seconds: the sound continues at the same loudness,
// and neither the beginning nor the end of the stall clicks. Time is counted in blocks.
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>

#include "common/random.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_writer.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/streaming/page_loader.h"
#include "tests/baked_room.h"
#include "tests/faults/fault_injection.h"
#include "tests/sanitized.h"
#include "tests/tools/run_clamor.h"
#include "tools/analysis/click_detector.h"
#include "tools/analysis/programme_loudness.h"

namespace clamor::testing {

namespace {

constexpr int kBlock_frames = 480;
constexpr int kBlocksPerSecond = kSampleRate_hz / kBlock_frames;
constexpr double kBefore_s = 2, kStall_s = 10, kAfter_s = 2;
constexpr double kAll_s = kBefore_s + kStall_s + kAfter_s;

// A room where all emitters play one signal: noise, whose loudness does not depend on interference,
// or tones, which reveal every click.
BakeContents room_of(const std::vector<float>& samples) {
  static const BakeContents room = baked_contents(2000);
  BakeContents contents = room;
  for (std::uint32_t s = 0; s < contents.signals.size(); ++s) {
    contents.signals[s].loop = true;
    contents.signals[s].samples = samples;
    // Emitters start at different times.
    std::rotate(contents.signals[s].samples.begin(),
                contents.signals[s].samples.begin() + 997 * (s + 1),
                contents.signals[s].samples.end());
  }
  return contents;
}

std::vector<float> noise() {
  std::vector<float> samples(2 * kSampleRate_hz);
  for (std::uint32_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<float>(0.05 * (unit(philox(3, {i, 0, 0, 0})[0]) - 0.5));
  return samples;
}

std::vector<float> tones() {
  std::vector<float> samples(kSampleRate_hz);
  for (std::size_t i = 0; i < samples.size(); ++i)
    for (const double tone_hz : {220.0, 700.0, 1300.0})
      samples[i] += static_cast<float>(
          0.01 * std::sin(2 * std::numbers::pi * tone_hz * static_cast<double>(i) / 48000));
  return samples;
}

// A walk round the room in 12 s.
Listener walking(double t) {
  const double angle = 2 * std::numbers::pi * t / 12;
  return {{3 + 1.8 * std::cos(angle), 4 + 2.5 * std::sin(angle), 1.5}, angle, 0};
}
Listener standing(double) { return {{4, 5, 1.6}, 0.4, 0}; }

struct Scene {
  std::string path;
  Listener (*pose)(double);
  AuralizerOptions options{};
};

std::unique_ptr<Auralizer> opened(const Scene& scene) {
  auto file = BakeFile::open(scene.path);
  EXPECT_TRUE(file.ok());
  auto auralizer =
      Auralizer::create(std::make_shared<const BakeFile>(std::move(*file)), scene.options);
  EXPECT_TRUE(auralizer.ok());
  return std::move(*auralizer);
}

// Plays for a number of seconds. Before each block, samples(time) says whether the sampler works,
// and at(block) runs. The listener follows block time, so a sampler that resumes finds the listener
// at the current position.
template <class Works>
Sound played(Auralizer& auralizer, const Scene& scene, double seconds, Works works) {
  Sound sound{std::vector<std::vector<float>>(2), kSampleRate_hz, {}};
  std::vector<float> block(2 * kBlock_frames);
  for (int i = 0; i < static_cast<int>(seconds * kBlocksPerSecond); ++i) {
    const double time_s = static_cast<double>(i) / kBlocksPerSecond;
    if (works(time_s))
      while (auralizer.wants_keyframe()) auralizer.make_keyframe(scene.pose(time_s));
    auralizer.mix(block);
    for (std::size_t s = 0; s < block.size(); ++s) sound.channels[s % 2].push_back(block[s]);
  }
  return sound;
}

constexpr auto kAlways = [](double) { return true; };
bool stalls(double time_s) { return time_s >= kBefore_s && time_s < kBefore_s + kStall_s; }

Sound part(const Sound& sound, double from_s, double to_s) {
  Sound part{{}, kSampleRate_hz, {}};
  for (const auto& channel : sound.channels)
    part.channels.emplace_back(channel.begin() + static_cast<std::ptrdiff_t>(from_s * 48000),
                               channel.begin() + static_cast<std::ptrdiff_t>(to_s * 48000));
  return part;
}

double lufs(const Sound& sound) { return programme_loudness(sound).integrated_lufs; }

// Expects no click that the undisturbed sound does not have.
void expect_no_new_clicks(const Sound& sound, const Sound& undisturbed) {
  for (std::size_t c = 0; c < 2; ++c) {
    float peak = 0;
    for (const float sample : sound.channels[c]) peak = std::max(peak, std::abs(sample));
    const auto known = find_clicks(undisturbed.channels[c], 1e-4 * peak);
    for (const Click& click : new_clicks(find_clicks(sound.channels[c], 1e-4 * peak), known))
      ADD_FAILURE() << "click at " << static_cast<double>(click.frame) / kSampleRate_hz << " s, of "
                    << click.sigmas << " sigmas";
  }
}

void expect_no_silence(const Sound& sound) {
  const double whole_lufs = lufs(sound);
  for (const double momentary_lufs : programme_loudness(sound).momentary_lufs)
    EXPECT_GT(momentary_lufs, whole_lufs - 6);
}

class Stalled : public ::testing::Test {
 protected:
  Scene scene(const std::vector<float>& signal, Listener (*pose)(double)) {
    const std::string path = folder / "room.clamor";
    EXPECT_TRUE(write_bake(path, room_of(signal), 2).ok());
    Scene made{path, pose};
    made.options.voices = 150;
    made.options.block_frames = kBlock_frames;
    return made;
  }

  Folder folder;
};

TEST_F(Stalled, SamplerLeavesAStandingListenerTheSoundAsItWas) {
  Scene still = scene(noise(), standing);
  still.options.wait_for_pages = true;
  const Sound undisturbed = played(*opened(still), still, kAll_s, kAlways);
  const auto auralizer = opened(still);
  const Sound stalled = played(*auralizer, still, kAll_s, [](double t) { return !stalls(t); });
  EXPECT_GT(auralizer->statistics().held_blocks, 900u);
  EXPECT_NEAR(lufs(part(stalled, kBefore_s, kBefore_s + kStall_s)),
              lufs(part(undisturbed, kBefore_s, kBefore_s + kStall_s)), 0.5);
  expect_no_silence(stalled);
  expect_no_new_clicks(stalled, undisturbed);
}

// The loudness stays that of the last position until the sampler resumes.
TEST_F(Stalled, SamplerLeavesAWalkerWhereTheyWere) {
  Scene walk = scene(noise(), walking);
  walk.options.wait_for_pages = true;
  const auto auralizer = opened(walk);
  const Sound stalled = played(*auralizer, walk, kAll_s, [](double t) { return !stalls(t); });
  EXPECT_GT(auralizer->statistics().held_blocks, 900u);
  expect_no_silence(stalled);

  Scene there = walk;
  there.pose = [](double) { return walking(kBefore_s); };
  const Sound standing_there = played(*opened(there), there, kStall_s + 1, kAlways);
  EXPECT_NEAR(lufs(part(stalled, kBefore_s + 0.1, kBefore_s + kStall_s)),
              lufs(part(standing_there, 1, kStall_s + 1)), 0.5);

  there.pose = [](double) { return walking(kBefore_s + kStall_s + 1); };
  const Sound afterwards = played(*opened(there), there, 3, kAlways);
  EXPECT_NEAR(lufs(part(stalled, kAll_s - 1.5, kAll_s - 0.5)), lufs(part(afterwards, 1, 3)), 1);
}

TEST_F(Stalled, SamplerClicksNeitherWhenItStopsNorWhenItGoesOn) {
  for (Listener (*const pose)(double) : {standing, walking}) {
    if (kSanitized && pose == standing) continue;  // slow
    Scene tonal = scene(tones(), pose);
    tonal.options.wait_for_pages = true;
    const Sound undisturbed = played(*opened(tonal), tonal, kAll_s, kAlways);
    const Sound stalled =
        played(*opened(tonal), tonal, kAll_s, [](double t) { return !stalls(t); });
    expect_no_new_clicks(stalled, undisturbed);
  }
}

// Every read of pages and sounds blocks while the listener walks through a room that does not fit
// into memory.
Sound with_a_stalled_loader(const Scene& scene, const Folder& folder, PageStatistics& pages) {
  const auto auralizer = opened(scene);
  std::atomic<bool> stands_still{false};
  const FaultInjection faults({.folder = folder.path(),
                               .calls = "pread",
                               .fail_at_call = 0,
                               .fate = FaultKind::kRunCallbackFromThenOn,
                               .meanwhile = [&] { stands_still.wait(true); }});
  const Sound sound = played(*auralizer, scene, kAll_s, [&](double time_s) {
    const bool now = stalls(time_s);
    if (stands_still && !now) {
      pages = auralizer->statistics().pages;
      stands_still = false;
      stands_still.notify_all();
    }
    stands_still = now;
    // Reading takes some time per block, as from a disk.
    if (!now) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return true;
  });
  EXPECT_TRUE(faults.struck());
  return sound;
}

// A walk whose sampler waits for all pages, and one whose loader stalls.
struct WalkTwice {
  WalkTwice(Scene walk, const Folder& folder) {
    walk.options.wait_for_pages = true;
    undisturbed = played(*opened(walk), walk, kAll_s, kAlways);
    walk.options.wait_for_pages = false;
    walk.options.memory_bytes = 400'000;
    PageStatistics pages;
    stalled = with_a_stalled_loader(walk, folder, pages);
    EXPECT_GT(pages.late, 500u);  // pages were missing all that time
  }
  Sound undisturbed, stalled;
};

TEST_F(Stalled, LoaderLeavesTheSoundAsLoudAsItIs) {
  const auto [undisturbed, stalled] = WalkTwice(scene(noise(), walking), folder);
  EXPECT_NEAR(lufs(part(stalled, kBefore_s, kBefore_s + kStall_s)),
              lufs(part(undisturbed, kBefore_s, kBefore_s + kStall_s)), 0.5);
  expect_no_silence(stalled);
  expect_no_new_clicks(stalled, undisturbed);
}

TEST_F(Stalled, LoaderClicksNeitherWhenItStopsNorWhenItGoesOn) {
  const auto [undisturbed, stalled] = WalkTwice(scene(tones(), walking), folder);
  expect_no_new_clicks(stalled, undisturbed);
}

}  // namespace

}  // namespace clamor::testing
