// auralizer_onset_test.cpp: the beginnings of sounds that moving sources play.
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/mixing/keyframe_maker.h"
#include "tests/baked_room.h"
#include "tests/runtime/hrtf_mixing.h"
#include "tests/runtime/moving_field.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::empty_field;
using testing::heard;
using testing::place_in_room;

// Three clicks; the first is the first sample of the signal.
constexpr double kClicks_s[] = {0, 0.005, 0.020};
Signal three_clicks(bool loop) {
  Signal clicks{"clicks", std::vector<float>(kSampleRate_hz / 2), loop};
  for (const double at_s : kClicks_s)
    clicks.samples[static_cast<std::size_t>(at_s * kSampleRate_hz)] = 1;
  return clicks;
}

struct Shot {
  bool loop = false;
  double start_s = 0.5, away_m = 3;
  OutputFormat::Kind output = OutputFormat::Kind::kTwoReceivers;
};

// Signal at the left ear. The source exists from the beginning, which gives the reference, or is
// added when its sound starts.
std::vector<float> heard_of(const Shot& shot, bool from_the_beginning) {
  AuralizerOptions options;
  options.moving.max_sources = 1;
  options.moving.signals = {three_clicks(shot.loop && !from_the_beginning)};
  options.moving.kinds = {{"shot", 0, {}}};
  options.output.kind = shot.output;
  if (shot.output == OutputFormat::Kind::kBinaural)
    options.output.head = std::make_shared<const Hrtf>(testing::no_head());
  const auto auralizer = std::move(*Auralizer::create(AuralizerInput{}, options));
  MovingSources& moving = *auralizer->moving();
  bool added = false;
  return heard(*auralizer, 1.1, [&](double t) {
    if (added || !(from_the_beginning || t >= shot.start_s)) return;
    MovingSource source;
    source.position_m = {-shot.away_m, 0, 0};
    source.start_s = shot.start_s;
    ASSERT_TRUE(moving.add(source).ok());
    moving.commit();
    added = true;
  });
}

double energy_db(const std::vector<float>& of, double from_s, double to_s) {
  double energy = 1e-20;
  for (auto n = static_cast<std::size_t>(from_s * kSampleRate_hz);
       n < static_cast<std::size_t>(to_s * kSampleRate_hz); ++n)
    energy += static_cast<double>(of[n]) * of[n];
  return 10 * std::log10(energy);
}

class MovingSourceOnset : public ::testing::TestWithParam<Shot> {};

TEST_P(MovingSourceOnset, IsCompleteThoughTheSourceIsAddedAsItStarts) {
  const Shot shot = GetParam();
  const auto meant = heard_of(shot, true), is = heard_of(shot, false);
  const double arrives_s = shot.start_s + shot.away_m / speed_of_sound_mps(Air{});
  for (const double at_s : kClicks_s) {
    const double from_s = arrives_s + at_s - 0.0015, to_s = from_s + 0.004;
    ASSERT_GT(energy_db(meant, from_s, to_s), -80);
    EXPECT_NEAR(energy_db(is, from_s, to_s), energy_db(meant, from_s, to_s), 0.1) << at_s;
  }
  // Nothing precedes the onset, and what follows equals the reference except for low frequencies:
  // their filters reach 30 ms ahead and are truncated where a sound starts sooner.
  EXPECT_LT(energy_db(is, 0, arrives_s - 0.03), energy_db(meant, 0, 1.1) - 50);
  std::vector<float> wrong(is.size());
  for (std::size_t n = 0; n < is.size(); ++n) wrong[n] = is[n] - meant[n];
  const double end_s = shot.start_s + 0.45;  // the loop repeats at 0.5 s
  EXPECT_LT(energy_db(wrong, 0, end_s), energy_db(meant, 0, end_s) - 20);
}

INSTANTIATE_TEST_SUITE_P(
    Sounds, MovingSourceOnset,
    ::testing::Values(Shot{}, Shot{.start_s = 0.507}, Shot{.start_s = 0.5199, .away_m = 0.5},
                      Shot{.away_m = 130}, Shot{.output = OutputFormat::Kind::kBinaural},
                      Shot{.loop = true}, Shot{.loop = true, .start_s = 0.507},
                      Shot{.loop = true, .away_m = 130},
                      Shot{.loop = true, .output = OutputFormat::Kind::kBinaural}));

// A loop that starts late continues as a loop, round after round.
TEST(MovingSources, RepeatALoopWithoutASeam) {
  const auto play = [](bool loop) {
    Signal sound = testing::sine(100);
    sound.samples.resize(std::size_t{10} * kSampleRate_hz / 100);
    sound.loop = true;
    if (!loop) {  // all rounds in one signal, played once
      const auto round = sound.samples;
      while (sound.samples.size() < std::size_t{2} * kSampleRate_hz)
        sound.samples.insert(sound.samples.end(), round.begin(), round.end());
      sound.loop = false;
    }
    const auto auralizer = empty_field({sound}, 1);
    MovingHandle handle;
    return heard(*auralizer, 1.5, [&](double t) {
      MovingSource source;
      source.position_m = {3 + t, 0, -2};
      source.start_s = 0.1;
      if (handle.generation == 0 && t >= 0.1) handle = *auralizer->moving()->add(source);
      if (handle.generation != 0) {
        ASSERT_TRUE(auralizer->moving()->move(handle, source.position_m).ok());
      }
      auralizer->moving()->commit();
    });
  };
  const auto is = play(true), meant = play(false);
  float peak = 0, most = 0;
  for (std::size_t n = 0; n < is.size(); ++n) {
    peak = std::max(peak, std::abs(meant[n]));
    most = std::max(most, std::abs(is[n] - meant[n]));
  }
  EXPECT_GT(peak, 0.05f);
  EXPECT_LT(most, 1e-4f * peak);
}

// The beginning of a loop is the same, read from a bake file or given in memory.
TEST(MovingSources, StartALoopOfTheBakeLikeOneOfTheirOwn) {
  const auto play = [](bool of_the_bake) {
    const auto file = testing::as_file(testing::baked_contents(300));
    AuralizerOptions options;
    options.wait_for_pages = true;
    options.voices = 60;
    options.moving.max_sources = 1;
    if (!of_the_bake) options.moving.signals = {*file->read_signal(1)};
    const auto of_bake = static_cast<std::uint32_t>(file->signal_count());
    options.moving.kinds = {{"tone", of_the_bake ? 1 : of_bake, {}}};
    const auto auralizer = std::move(*Auralizer::create(file, options));
    bool added = false;
    return heard(*auralizer, 1, [&](double t) {
      if (added || t < 0.3) return;
      MovingSource source;
      source.position_m = {1, 1, 1};
      source.start_s = 0.31;
      source.gain = same_in_all_bands(5);
      ASSERT_TRUE(auralizer->moving()->add(source).ok());
      auralizer->moving()->commit(t);
      added = true;
    });
  };
  EXPECT_EQ(play(true), play(false));
}

// kStartsWhenHeard serves callers that do not know how far ahead keyframes are made.
TEST(MovingSources, StartInTheNextKeyframeIfAskedTo) {
  const auto auralizer = empty_field({three_clicks(false)}, 1);
  MovingHandle handle;
  const auto out = heard(*auralizer, 1, [&](double t) {
    MovingSource source;
    source.position_m = {-3, 0, 0};
    source.start_s = kStartsWhenHeard;
    if (t >= 0.3 && handle.generation == 0) handle = *auralizer->moving()->add(source);
    // A change of gain does not restart the sound.
    if (t >= 0.4) {
      ASSERT_TRUE(auralizer->moving()->change(handle, source).ok());
    }
    auralizer->moving()->commit(t);
  });
  const double arrives_s = 0.28 + (3 - kEarDistance_m / 2) / speed_of_sound_mps(Air{});
  std::vector<double> clicks_db;
  for (const double at_s : kClicks_s)
    clicks_db.push_back(energy_db(out, arrives_s + at_s - 0.0015, arrives_s + at_s + 0.0025));
  EXPECT_GT(clicks_db[0], -30);
  EXPECT_NEAR(clicks_db[0], clicks_db[2], 0.1);
  EXPECT_NEAR(clicks_db[1], clicks_db[2], 0.1);
  EXPECT_LT(energy_db(out, 0.4, 1), clicks_db[2] - 50);
}

}  // namespace
}  // namespace clamor
