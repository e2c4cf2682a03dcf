// auralizer_moving_sources_test.cpp: pitch, clicks and occlusion of moving sources.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "runtime/measures/click_detector.h"
#include "tests/baked_room.h"
#include "tests/runtime/hrtf_mixing.h"
#include "tests/runtime/moving_field.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::empty_field;
using testing::heard;
using testing::place_in_room;

constexpr double kTone_hz = 1000, kSpeed_mps = 30, kNearest_m = 8;

double delay_s(double t) {
  return testing::delay_of_moving_s({kSpeed_mps * (t - 1), 0, -kNearest_m}, {kSpeed_mps, 0, 0},
                                    {-kEarDistance_m / 2, 0, 0});
}

// Largest pitch error of a tone against one with the given delay, from the phases of windows of 6
// ms, 3 ms apart.
template <class Delay>
double worst_pitch_error(const std::vector<float>& out, const Delay& meant_delay_s,
                         double from_s = 0.08) {
  const auto wrong_phase = [&](std::size_t first) {
    std::complex<double> is = 0, meant = 0;
    for (std::size_t n = first; n < first + 288; ++n) {
      const double t = static_cast<double>(n) / kSampleRate_hz;
      const double window = std::sin(std::numbers::pi * static_cast<double>(n - first) / 288);
      const double phase = 2 * std::numbers::pi * kTone_hz * (t - meant_delay_s(t));
      const auto back = std::polar(window * window, -phase);
      is += static_cast<double>(out[n]) * back;
      meant += std::sin(phase) * back;
    }
    return std::arg(is / meant);
  };
  double worst_hz = 0;
  for (auto n = static_cast<std::size_t>(from_s * kSampleRate_hz); n + 432 < out.size(); n += 144) {
    const double turned =
        std::remainder(wrong_phase(n + 144) - wrong_phase(n), 2 * std::numbers::pi);
    worst_hz = std::max(worst_hz, std::abs(turned) / (2 * std::numbers::pi) * kSampleRate_hz / 144);
  }
  return worst_hz / kTone_hz;
}

MovingSource passing(double t) {
  MovingSource source;
  source.position_m = {kSpeed_mps * (t - 1), 0, -kNearest_m};
  source.velocity_mps = {kSpeed_mps, 0, 0};
  return source;
}

TEST(MovingSources, HaveTheDopplerShiftOfAPassingSource) {
  const auto auralizer = empty_field({testing::sine(kTone_hz)}, 10);
  MovingSources& moving = *auralizer->moving();
  const auto car = *moving.add(passing(0));
  const auto out = heard(*auralizer, 2, [&](double t) {
    ASSERT_TRUE(moving.move(car, passing(t).position_m).ok());
    moving.commit();
  });
  // Sound that left before the first move left a source at rest.
  EXPECT_LT(worst_pitch_error(out, delay_s, 0.2), 0.001);
}

TEST(MovingSources, HaveThatShiftInAGameAtSixtyFramesPerSecond) {
  const auto auralizer = empty_field({testing::sine(kTone_hz)}, 10);
  MovingSources& moving = *auralizer->moving();
  const auto car = *moving.add(passing(0));
  const auto out = heard(*auralizer, 2, [&](double t) {
    const double frame_s = std::floor(t * 60) / 60;
    ASSERT_TRUE(moving.move(car, passing(frame_s).position_m, {kSpeed_mps, 0, 0}).ok());
    moving.commit(frame_s);
  });
  EXPECT_LT(worst_pitch_error(out, delay_s), 0.001);
}

// Source and listener move past each other in turn, which gives different pitches.
enum class Mover : std::uint8_t { kSource, kListener };
struct Drive {
  Mover mover;
  double speed_mps, nearest_m;
};

double worst_cents(const Drive& drive) {
  const Vec3 velocity_mps(drive.speed_mps, 0, 0);
  const auto moved_m = [&](double t) { return (t - 1.5) * velocity_mps; };
  const Vec3 still_m(0, 0, -drive.nearest_m);
  const bool source_moves = drive.mover == Mover::kSource;
  AuralizerOptions options;
  options.moving.max_sources = 1;
  options.moving.signals = {testing::sine(kTone_hz)};
  options.moving.kinds = {{"tone", 0, {}}};
  // An HRTF's bands are zero-phase and add no delay (mixer.h).
  options.output.kind = OutputFormat::Kind::kBinaural;
  options.output.head = std::make_shared<const Hrtf>(testing::no_head());
  const auto auralizer = std::move(*Auralizer::create(AuralizerInput{}, options));
  MovingSources& moving = *auralizer->moving();
  MovingSource source;
  source.position_m = still_m + (source_moves ? moved_m(0) : Vec3(0));
  source.velocity_mps = source_moves ? velocity_mps : Vec3(0);
  const auto handle = *moving.add(source);
  moving.commit(0);
  std::vector<float> left, block(2 * kKeyframeFrames);
  while (left.size() < std::size_t{3} * kSampleRate_hz) {
    while (auralizer->wants_keyframe()) {
      const double t = auralizer->next_keyframe_time_s();
      if (source_moves) {
        EXPECT_TRUE(moving.move(handle, still_m + moved_m(t), velocity_mps).ok());
        moving.commit(t);
      }
      auralizer->make_keyframe({source_moves ? Vec3(0) : -moved_m(t), 0, 0});
    }
    auralizer->mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
  }
  // A sudden start counts as a teleport, with a crossfade of 0.1 s.
  const auto delay_s = [&](double t) {
    if (source_moves)
      return testing::delay_of_moving_s(still_m + moved_m(t), velocity_mps, Vec3(0));
    return testing::delay_of_moving_s(still_m, Vec3(0), -moved_m(t));
  };
  const double worst = worst_pitch_error(left, delay_s, 0.25);
  return 1200 * std::log2(1 + worst);
}

TEST(MovingSourcesDoppler, IsWithinACentOfTheoryUpTo100MetresPerSecond) {
  for (const Mover mover : {Mover::kSource, Mover::kListener})
    for (const double speed_mps : {3.0, 30.0, 100.0})
      for (const double nearest_m : {200.0, 30.0})
        EXPECT_LT(worst_cents({mover, speed_mps, nearest_m}), 1)
            << (mover == Mover::kSource ? "source" : "listener") << " at " << speed_mps << " m/s, "
            << nearest_m << " m away";
}

// Three clicks; the first is the signal's first sample.
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

// The left ear. The source is present from the beginning, which gives the expected sound, or added
// only as its signal begins.
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
  // Nothing precedes the onset, and what follows is the expected sound, except for low frequencies:
  // their filters reach 30 ms ahead and are cut where a sound begins sooner.
  EXPECT_LT(energy_db(is, 0, arrives_s - 0.03), energy_db(meant, 0, 1.1) - 50);
  std::vector<float> wrong(is.size());
  for (std::size_t n = 0; n < is.size(); ++n) wrong[n] = is[n] - meant[n];
  const double end_s = shot.start_s + 0.45;  // a loop repeats at 0.5
  EXPECT_LT(energy_db(wrong, 0, end_s), energy_db(meant, 0, end_s) - 20);
}

INSTANTIATE_TEST_SUITE_P(
    Sounds, MovingSourceOnset,
    ::testing::Values(Shot{}, Shot{.start_s = 0.507}, Shot{.start_s = 0.5199, .away_m = 0.5},
                      Shot{.away_m = 130}, Shot{.output = OutputFormat::Kind::kBinaural},
                      Shot{.loop = true}, Shot{.loop = true, .start_s = 0.507},
                      Shot{.loop = true, .away_m = 130},
                      Shot{.loop = true, .output = OutputFormat::Kind::kBinaural}));

// A loop that begins continues as the loop, repeat after repeat.
TEST(MovingSources, GoOnAsTheLoopThatBegan) {
  const auto play = [](bool loop) {
    Signal sound = testing::sine(100);
    sound.samples.resize(std::size_t{10} * kSampleRate_hz / 100);
    sound.loop = true;
    if (!loop) {  // all repeats, as one signal that plays once
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

// The beginning of a loop is the same from a bake file as from signals in memory.
TEST(MovingSources, BeginWithALoopOfTheBakeAsWithTheirOwn) {
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

// A caller that plays a sound now need not know how far ahead keyframes are made.
TEST(MovingSources, StartWhenTheyAreFirstHeardIfTheyAreToldTo) {
  const auto auralizer = empty_field({three_clicks(false)}, 1);
  MovingHandle handle;
  const auto out = heard(*auralizer, 1, [&](double t) {
    MovingSource source;
    source.position_m = {-3, 0, 0};
    source.start_s = kStartsWhenHeard;
    if (t >= 0.3 && handle.generation == 0) handle = *auralizer->moving()->add(source);
    // A change of gain does not restart the signal.
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

TEST(MovingSources, AppearMoveChangeAndDisappearWithoutClicks) {
  const auto auralizer = empty_field({testing::sine(200), testing::sine(300)}, 50, "priority", 8);
  MovingSources& moving = *auralizer->moving();
  std::vector<MovingHandle> handles;
  const auto source = [](std::uint32_t i, double t) {
    MovingSource at;
    at.kind = (i + static_cast<std::uint32_t>(t)) % 2;
    at.position_m = {4 * std::sin(t + i), 3 * std::cos(1.3 * t + 2 * i), 2.0 + 0.1 * i};
    at.gain = same_in_all_bands(0.05f + 0.05f * static_cast<float>(std::fmod(t, 1)));
    return at;
  };
  int keyframe = 0;
  std::vector<float> out = heard(*auralizer, 6, [&](double t) {
    if (keyframe % 10 == 0 && t < 4) handles.push_back(*moving.add(source(keyframe, t)));
    if (keyframe % 20 == 19 && !handles.empty()) {
      ASSERT_TRUE(moving.remove(handles.front()).ok());
      handles.erase(handles.begin());
    }
    for (std::uint32_t i = 0; i < handles.size(); ++i)
      ASSERT_TRUE(moving.change(handles[i], source(i, t)).ok());
    if (t >= 5) {
      for (const MovingHandle handle : handles) ASSERT_TRUE(moving.remove(handle).ok());
      handles.clear();
    }
    moving.commit();
    ++keyframe;
  });
  float peak = 0;
  for (const float sample : out) peak = std::max(peak, std::abs(sample));
  EXPECT_GT(peak, 0.05f);
  // The last second is silent; rounding noise there is no click.
  const std::size_t end = std::size_t{5} * kSampleRate_hz;
  EXPECT_LT(std::abs(out.back()), 1e-6f);
  for (const Click& click : find_clicks(std::span(out).first(end), 1e-3 * peak))
    ADD_FAILURE() << click.sigmas << " sigmas at " << click.frame;
}

TEST(MovingSources, SoundLikeStrategyAllWithEnoughVoices) {
  const auto few = empty_field({testing::sine(200), testing::sine(300)}, 20);
  const auto all = empty_field({testing::sine(200), testing::sine(300)}, 20, "all");
  const auto play = [](Auralizer& auralizer) {
    MovingSources& moving = *auralizer.moving();
    for (std::uint32_t i = 0; i < 20; ++i) {
      MovingSource source;
      source.kind = i % 2;
      source.position_m = place_in_room(i, 0);
      source.velocity_mps = {1, 0, 2};
      EXPECT_TRUE(moving.add(source).ok());
    }
    moving.commit(0);
    return heard(auralizer, 1, [](double) {});
  };
  EXPECT_EQ(play(*few), play(*all));
}

// A listener at x = 3, a wall 40 m wide and high at x = `wall_x_m`, and a moving tone of 1 kHz.
// `wait` renders with exact visibility, as offline renders do.
class BesideAWall {
 public:
  BesideAWall(float wall_x_m, float lets_through, bool wait) {
    AuralizerInput input;
    input.materials.resize(1);
    input.materials[0].absorption = same_in_all_bands(0.9f);
    input.materials[0].transmission = same_in_all_bands(lets_through);
    for (const auto& [y, z] : {std::pair(-20, -20), {20, -20}, {20, 20}, {-20, 20}})
      input.mesh.vertices_m.push_back({wall_x_m, y, z});
    input.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    input.mesh.materials = {0, 0};
    AuralizerOptions options;
    options.moving.max_sources = 1;
    options.moving.signals = {testing::sine(1000)};
    options.moving.kinds = {{"tone", 0, {}}};
    options.wait_for_pages = wait;
    auralizer_ = std::move(*Auralizer::create(std::move(input), options));
    source_ = *auralizer_->moving()->add({.position_m = {2, 0, 0}});
  }

  // The level 0.8 s after the source was put there.
  double level_db(const Vec3& position_m) {
    EXPECT_TRUE(auralizer_->moving()->move(source_, position_m).ok());
    auralizer_->moving()->commit();
    std::vector<float> block(2 * kKeyframeFrames);
    double power = 0;
    for (int keyframe = 0; keyframe < 40; ++keyframe) {
      while (auralizer_->wants_keyframe()) auralizer_->make_keyframe({{3, 0, 0}, 0, 0});
      auralizer_->mix(block);
      power = 0;
      for (const float sample : block) power += static_cast<double>(sample) * sample;
    }
    return 10 * std::log10(power + 1e-30);
  }

 private:
  std::unique_ptr<Auralizer> auralizer_;
  MovingHandle source_;
};

TEST(MovingSources, AreOccludedByAnOpaqueWall) {
  for (const bool wait : {true, false}) {
    BesideAWall world(0, 0, wait);
    const double before_db = world.level_db({2, 0, 1});
    EXPECT_LT(world.level_db({-2, 0, 1}), before_db - 100);
    EXPECT_NEAR(world.level_db({2, 0, 1}), before_db, 0.1);
  }
}

TEST(MovingSources, AreAttenuatedByTheTransmissionOfAWall) {
  for (const bool wait : {true, false}) {
    BesideAWall world(0, 0.01f, wait);
    const double before_db = world.level_db({2, 0, 0});
    // 1 m in front and 5 m behind the wall; the path around it is 34 m longer.
    EXPECT_NEAR(world.level_db({-2, 0, 0}) - before_db, 20 * std::log10(1 / 5.0) - 20, 0.2);
    EXPECT_NEAR(world.level_db({2, 0, 0}), before_db, 0.1);
  }
}

TEST(MovingSources, AreOccludedByAWallThatTheyCrossInOneStep) {
  for (const bool wait : {true, false}) {
    BesideAWall world(0.3f, 0, wait);
    // An occluded source's estimate is valid for half a metre there, and the wall is in between.
    const double before_db = world.level_db({0.45, 0, 0});
    EXPECT_LT(world.level_db({0.1, 0, 0}), before_db - 100);
    EXPECT_NEAR(world.level_db({0.45, 0, 0}), before_db, 0.1);
  }
}

TEST(MovingSources, NeedAStrategyThatSupportsThem) {
  AuralizerOptions options;
  options.moving.max_sources = 1;
  options.strategy = "importance";
  const auto made = Auralizer::create(testing::baked_room(), options);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("knows nothing of moving sources"), std::string::npos);
}

}  // namespace
}  // namespace clamor
