#include "runtime/moving_sources.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <thread>

#include <gtest/gtest.h>
#include <unistd.h>

#include "common/random.h"
#include "runtime/click_detector.h"
#include "runtime/moving_list.h"
#include "runtime/sampler.h"
#include "tests/rooms_runtime.h"
#include "tests/runtime/priority_estimates.h"

namespace clamor {
namespace {

Vec3 place_in_room(std::uint32_t i, std::uint32_t step) {
  const RandomBits bits = philox(8, {i, step, 0, 0});
  return {6 * unit(bits[0]), 8 * unit(bits[1]), 3 * unit(bits[2])};
}

// A baked room, and two kinds of sources that move about in it.
struct Stage {
  static constexpr std::size_t kKinds = 2;

  explicit Stage(std::size_t most)
      : input(with_kinds()),
        field(input.emitters, input.materials, input.air),
        moving(most, kKinds),
        list(moving, field, by_signal(), input.emitters, kKinds) {}

  static AuralizerInput with_kinds() {
    AuralizerInput input = testing::baked_room(400);
    MovingOptions options;
    options.kinds = {{"car", 0, {}}, {"horn", 1, same_in_all_bands(3)}};
    EXPECT_TRUE(add_kinds(options, input).ok());
    return input;
  }
  const std::vector<Bands>& by_signal() {
    weights.by_signal.assign(input.signals.size(), {1, 2, 3, 4, 5, 4, 3, 2});
    return weights.by_signal;
  }
  MovingHandle add(std::uint32_t i, double gain = 1) {
    MovingSource source;
    source.kind = i % 2;
    source.position_m = place_in_room(i, 0);
    source.axis = {1, 0.5, -1};
    source.gain = same_in_all_bands(static_cast<float>(gain));
    auto handle = moving.add(source);
    EXPECT_TRUE(handle.ok());
    return *handle;
  }
  double weight_of(const Source& source, const Vec3& place) const {
    return weight(field, weights.by_signal[field.signal(source)], source, place);
  }
  // All that move, as they were committed.
  std::vector<FoundSource> all_moving(const Vec3& place, double time_s) {
    std::vector<FoundSource> found;
    list.refresh();
    list.begin(place, time_s);
    list.look(place, 0, found);
    return found;
  }

  SignalWeights weights;
  AuralizerInput input;
  SourceField field;
  MovingSources moving;
  MovingList list;
};

TEST(MovingSources, AreChosenAsASortOfThemAndAllOthersChooses) {
  constexpr std::size_t kVoices = 150;
  Stage stage(2000);
  SourceList still(stage.field, stage.weights, stage.input.sources);
  JoinedPool pool(still, stage.list);
  const auto sampler = make_priority_sampler(stage.field, stage.weights, pool, kVoices);
  std::vector<MovingHandle> handles;
  for (std::uint32_t step = 0; step < 60; ++step) {
    const Vec3 listener(1 + 0.05 * step, 2 + 0.03 * step, 1.5);
    for (std::uint32_t i = 0; i < 30; ++i) handles.push_back(stage.add(30 * step + i, 0.1));
    if (step % 3 == 0) {
      EXPECT_TRUE(stage.moving.remove(handles[7 * step]).ok());
    }
    for (std::uint32_t i = 0; i < handles.size(); i += 2)
      if (step % 3 != 0 || i != 7 * step)
        (void)stage.moving.move(handles[i], place_in_room(i, step));
    stage.moving.commit();

    std::map<std::uint64_t, double> sample;
    for (const SampledSource& chosen : sampler->sample(listener, 0.02 * step))
      sample[chosen.number] = chosen.power_scale;

    struct Entry {
      double priority, weight;
      std::uint64_t number;
    };
    std::vector<Entry> all;
    const auto add = [&](std::uint64_t number, const Source& source) {
      const double w = stage.weight_of(source, listener);
      if (w > 0) all.push_back({w / static_cast<double>(source.u), w, number});
    };
    for (std::size_t i = 0; i < still.page().size(); ++i) add(i, still.page()[i]);
    const auto moving = stage.all_moving(listener, 0.02 * step);
    EXPECT_EQ(moving.size(), stage.moving.size());
    for (const FoundSource& found : moving) add(found.voice, *found.source);
    std::sort(all.begin(), all.end(),
              [](const Entry& a, const Entry& b) { return a.priority > b.priority; });
    ASSERT_EQ(sample.size(), kVoices);
    int of_moving = 0;
    for (std::size_t i = 0; i < kVoices; ++i) {
      ASSERT_TRUE(sample.contains(all[i].number)) << "step " << step;
      ASSERT_NEAR(sample[all[i].number] / std::max(1.0, all[kVoices].priority / all[i].weight), 1,
                  1e-12);
      of_moving += (all[i].number & kMovingNumber) != 0;
    }
    EXPECT_GT(of_moving, 0);
    EXPECT_LT(of_moving, static_cast<int>(kVoices));
  }
}

TEST(MovingSources, AreUnbiasedInPowerOverTheirPermanentNumbers) {
  constexpr std::size_t kVoices = 20, kSources = 200;
  constexpr int kRolls = 1000;
  Stage stage(kSources);
  SourceList none(stage.field, stage.weights, {});
  JoinedPool pool(none, stage.list);
  const auto sampler = make_priority_sampler(stage.field, stage.weights, pool, kVoices);
  const Vec3 listener(4, 5, 1.6);
  std::vector<MovingHandle> handles;
  testing::PriorityEstimates estimates;
  for (int roll = 0; roll < kRolls; ++roll) {
    for (const MovingHandle handle : handles) ASSERT_TRUE(stage.moving.remove(handle).ok());
    handles.clear();
    for (std::uint32_t i = 0; i < kSources; ++i) handles.push_back(stage.add(i));
    stage.moving.commit();
    double whole = 0, estimate = 0;
    for (const SampledSource& chosen : sampler->sample(listener, roll))
      estimate += chosen.power_scale * stage.weight_of(*chosen.source, listener);
    for (const FoundSource& found : stage.all_moving(listener, roll))
      whole += stage.weight_of(*found.source, listener);
    estimates.add(estimate / whole);
  }
  estimates.expect_unbiased(kVoices);
}

TEST(MovingSources, AreWhereTheirVelocityHasTakenThemByEachKeyframe) {
  Stage stage(1);
  MovingSource source;
  source.position_m = {10, 0, 0};
  source.velocity_mps = {30, -3, 0};
  ASSERT_TRUE(stage.moving.add(source).ok());
  stage.moving.commit(5);
  const auto at = [&](double time_s) {
    return stage.all_moving({}, time_s).front().source->position_m;
  };
  EXPECT_NEAR(at(5.1).x, 13, 1e-5);
  EXPECT_NEAR(at(5.2).x, 16, 1e-5);
  EXPECT_NEAR(at(5.2).y, -0.6, 1e-5);
  EXPECT_NEAR(at(4.9).x, 7, 1e-5);
  // Nobody has moved it for so long that it may be anywhere: it stops.
  EXPECT_NEAR(at(9).x, 10 + 30 * kLongestCoast_s, 1e-4);
}

TEST(MovingSources, SayWhatIsWrongAndChangeNothingThen) {
  MovingSources moving(2, 1);
  MovingSource source;
  const auto first = moving.add(source);
  ASSERT_TRUE(first.ok() && moving.add(source).ok());
  const auto full = moving.add(source);
  ASSERT_FALSE(full.ok());
  EXPECT_NE(full.error().message.find("there are 2 moving sources already"), std::string::npos);
  EXPECT_FALSE(moving.move(*first, {NAN, 0, 0}).ok());
  EXPECT_FALSE(moving.move({}, {}).ok());
  source.kind = 1;
  EXPECT_FALSE(moving.retune(*first, source).ok());
  ASSERT_TRUE(moving.remove(*first).ok());
  EXPECT_FALSE(moving.remove(*first).ok());
  source.kind = 0;
  const auto again = moving.add(source);  // in the same place
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(moving.move(*first, {1, 2, 3}).ok()) << "a handle never names another source";
  EXPECT_TRUE(moving.move(*again, {1, 2, 3}).ok());
}

// A hundred thousand, all moved for every keyframe: still the same sample as a sort's.
TEST(MovingSources, AreAHundredThousandThatAllMoveForEveryKeyframe) {
  constexpr std::size_t kMany = 100'000, kVoices = 500;
  Stage stage(kMany);
  SourceList still(stage.field, stage.weights, stage.input.sources);
  JoinedPool pool(still, stage.list);
  const auto sampler = make_priority_sampler(stage.field, stage.weights, pool, kVoices);
  std::vector<MovingHandle> handles;
  for (std::uint32_t i = 0; i < kMany; ++i) handles.push_back(stage.add(i, 0.01));
  const Vec3 listener(3, 4, 1.5);
  for (std::uint32_t step = 0; step < 10; ++step) {
    for (std::uint32_t i = 0; i < kMany; ++i)
      ASSERT_TRUE(stage.moving.move(handles[i], place_in_room(i, step)).ok());
    stage.moving.commit();
    std::vector<std::uint64_t> sample;
    for (const SampledSource& chosen : sampler->sample(listener, 0.02 * step))
      sample.push_back(chosen.number);
    if (step % 3 != 0) continue;
    std::vector<std::pair<double, std::uint64_t>> all;
    for (std::size_t i = 0; i < still.page().size(); ++i)
      all.emplace_back(
          stage.weight_of(still.page()[i], listener) / static_cast<double>(still.page()[i].u), i);
    for (const FoundSource& found : stage.all_moving(listener, 0.02 * step))
      all.emplace_back(
          stage.weight_of(*found.source, listener) / static_cast<double>(found.source->u),
          found.voice);
    std::nth_element(all.begin(), all.begin() + kVoices, all.end(), std::greater<>());
    std::vector<std::uint64_t> expected;
    for (std::size_t i = 0; i < kVoices; ++i) expected.push_back(all[i].second);
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(sample, expected) << "step " << step;
  }
}

// Positions and tunes of one commit, never of two, and never of an older one than before.
TEST(MovingSources, AreHandedOverWholeWhileTheCallerGoesOn) {
  constexpr std::size_t kSources = 200;
  constexpr std::uint32_t kCommits = 20'000;
  MovingSources moving(kSources, 1);
  std::vector<MovingHandle> handles;
  MovingSource first;
  first.gain = same_in_all_bands(0);  // as what is committed at time 0
  for (std::size_t i = 0; i < kSources; ++i) handles.push_back(*moving.add(first));
  moving.commit(0);
  std::atomic<bool> wrong{false};
  std::thread sampler([&] {
    double last = 0;
    while (last < kCommits) {
      const MovingSources::Snapshot& now = moving.latest();
      if (now.commits == 0) continue;
      const auto meant = static_cast<float>(now.time_s);
      for (std::size_t i = 0; i < now.count; ++i)
        if (now.x_m[i] != meant || (now.tunes[i].present && now.tunes[i].gain[3] != meant))
          wrong = true;
      if (now.time_s < last) wrong = true;
      last = now.time_s;
    }
  });
  for (std::uint32_t commit = 1; commit <= kCommits; ++commit) {
    MovingSource source;
    source.position_m.x = commit;
    source.gain = same_in_all_bands(static_cast<float>(commit));
    for (std::size_t i = 0; i < kSources; ++i) {
      if ((i + commit) % 50 == 0) {
        ASSERT_TRUE(moving.remove(handles[i]).ok());
        handles[i] = *moving.add(source);
      } else {
        ASSERT_TRUE(moving.retune(handles[i], source).ok());
      }
    }
    moving.commit(commit);
  }
  sampler.join();
  EXPECT_FALSE(wrong);
}

// ---- Heard ------------------------------------------------------------------------------------

constexpr double kTone_hz = 1000, kSpeed_mps = 30, kNearest_m = 8;

// A free field with nothing in it.
std::unique_ptr<Auralizer> empty_field(std::vector<Signal> signals, std::size_t most,
                                       const std::string& strategy = "priority", int voices = 100) {
  AuralizerInput input;
  AuralizerOptions options;
  options.strategy = strategy;
  options.voices = voices;
  options.moving.most = most;
  for (std::uint32_t s = 0; s < signals.size(); ++s)
    options.moving.kinds.push_back({signals[s].name, s, {}});
  options.moving.signals = std::move(signals);
  auto made = Auralizer::create(std::move(input), options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  return std::move(*made);
}

// The left ear of one who stands at the origin; `before_keyframe(time_s)` moves things.
template <class Before>
std::vector<float> heard(Auralizer& auralizer, double seconds, Before before_keyframe) {
  std::vector<float> left, block(2 * kKeyframeFrames);
  while (static_cast<double>(left.size()) < seconds * kSampleRate_hz) {
    while (auralizer.wants_keyframe()) {
      before_keyframe(auralizer.next_keyframe_time_s());
      auralizer.make_keyframe({});
    }
    auralizer.mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
  }
  return left;
}

double delay_s(double t) {
  const Vec3 source(kSpeed_mps * (t - 1), 0, -kNearest_m), ear(-kEarDistance_m / 2, 0, 0);
  return length(source - ear) / speed_of_sound_mps(Air{});
}

// Of a tone that passes, against what would be in the air: the worst difference of pitches.
double worst_pitch_error(const std::vector<float>& out) {
  const auto wrong_phase = [&](std::size_t first) {
    std::complex<double> is = 0, meant = 0;
    for (std::size_t n = first; n < first + 288; ++n) {
      const double t = static_cast<double>(n) / kSampleRate_hz;
      const double window = std::sin(std::numbers::pi * static_cast<double>(n - first) / 288);
      const double phase = 2 * std::numbers::pi * kTone_hz * (t - delay_s(t));
      const auto back = std::polar(window * window, -phase);
      is += static_cast<double>(out[n]) * back;
      meant += std::sin(phase) * back;
    }
    return std::arg(is / meant);
  };
  double worst_hz = 0;
  for (std::size_t n = 4 * kKeyframeFrames; n + 432 < out.size(); n += 144) {
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

TEST(MovingSources, PassWithThePitchThatDopplerSays) {
  const auto auralizer = empty_field({testing::sine(kTone_hz)}, 10);
  MovingSources& moving = *auralizer->moving();
  const auto car = *moving.add(passing(0));
  const auto out = heard(*auralizer, 2, [&](double t) {
    ASSERT_TRUE(moving.move(car, passing(t).position_m).ok());
    moving.commit();
  });
  EXPECT_LT(worst_pitch_error(out), 0.001);
}

TEST(MovingSources, PassWithThatPitchThoughTheGameRunsAtSixtyFramesASecond) {
  const auto auralizer = empty_field({testing::sine(kTone_hz)}, 10);
  MovingSources& moving = *auralizer->moving();
  const auto car = *moving.add(passing(0));
  const auto out = heard(*auralizer, 2, [&](double t) {
    const double frame_s = std::floor(t * 60) / 60;
    ASSERT_TRUE(moving.move(car, passing(frame_s).position_m, {kSpeed_mps, 0, 0}).ok());
    moving.commit(frame_s);
  });
  EXPECT_LT(worst_pitch_error(out), 0.001);
}

TEST(MovingSources, ComeMoveChangeAndGoWithoutAClick) {
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
      ASSERT_TRUE(moving.retune(handles[i], source(i, t)).ok());
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
  // The last second is silent: digital noise is not what clicks are looked for in.
  const std::size_t end = std::size_t{5} * kSampleRate_hz;
  EXPECT_LT(std::abs(out.back()), 1e-6f);
  for (const Click& click : find_clicks(std::span(out).first(end), 1e-3 * peak))
    ADD_FAILURE() << click.sigmas << " sigmas at " << click.frame;
}

TEST(MovingSources, SoundTheSameAsAllWhereThereIsRoomForAll) {
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

// A listener at x = 3, a wall across x = `wall_x_m`, 40 m wide and high, and a tone of 1 kHz that
// moves. `wait` as for a render, which is exact.
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
    options.moving.most = 1;
    options.moving.signals = {testing::sine(1000)};
    options.moving.kinds = {{"tone", 0, {}}};
    options.wait_for_pages = wait;
    auralizer_ = std::move(*Auralizer::create(std::move(input), options));
    source_ = *auralizer_->moving()->add({.position_m = {2, 0, 0}});
  }

  // What is heard of it 0.8 s after it was put there.
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

TEST(MovingSources, AreHiddenByWhatStandsInTheWay) {
  for (const bool wait : {true, false}) {
    BesideAWall world(0, 0, wait);
    const double before_db = world.level_db({2, 0, 1});
    EXPECT_LT(world.level_db({-2, 0, 1}), before_db - 100);
    EXPECT_NEAR(world.level_db({2, 0, 1}), before_db, 0.1);
  }
}

TEST(MovingSources, AreHeardThroughAWallAsFarAsItLetsThrough) {
  for (const bool wait : {true, false}) {
    BesideAWall world(0, 0.01f, wait);
    const double before_db = world.level_db({2, 0, 0});
    // 1 m before, 5 m behind; what comes round the wall has a detour of 34 m.
    EXPECT_NEAR(world.level_db({-2, 0, 0}) - before_db, 20 * std::log10(1 / 5.0) - 20, 0.2);
    EXPECT_NEAR(world.level_db({2, 0, 0}), before_db, 0.1);
  }
}

TEST(MovingSources, AreNotHeardThroughAWallThatTheyCrossedByAStep) {
  for (const bool wait : {true, false}) {
    BesideAWall world(0.3f, 0, wait);
    // What is known of hidden sources is known for half a metre there, and the wall is in between.
    const double before_db = world.level_db({0.45, 0, 0});
    EXPECT_LT(world.level_db({0.1, 0, 0}), before_db - 100);
    EXPECT_NEAR(world.level_db({0.45, 0, 0}), before_db, 0.1);
  }
}

TEST(MovingSources, NeedAStrategyThatKnowsThem) {
  AuralizerOptions options;
  options.moving.most = 1;
  options.strategy = "importance";
  const auto made = Auralizer::create(testing::baked_room(), options);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("knows nothing of moving sources"), std::string::npos);
}

// ---- As a script --------------------------------------------------------------------------------

std::string written(const std::string& text) {
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("clamor_moving_" + std::to_string(::getpid()) + ".json"))
                               .string();
  std::ofstream(path) << text;
  return path;
}

TEST(MovingScript, MovesWhatItNamesAsACallerWould) {
  const std::string path = written(R"({ "sources": [
      { "name": "car", "signal": "noise", "gain_db": -6.0206, "from_s": 0.2, "until_s": 0.6,
        "path": { "points": [ { "time_s": 0, "position_m": [-10, 0, -5] },
                              { "time_s": 1, "position_m": [20, 0, -5] } ] } } ] })");
  auto script = MovingScript::read(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(script.ok()) << script.error().message;
  AuralizerOptions options;
  options.moving = script->options(0);
  ASSERT_EQ(options.moving.signals.size(), 1u);
  const auto by_hand = Auralizer::create(AuralizerInput{}, options);
  options.script = std::make_shared<MovingScript>(std::move(*script));
  const auto by_script = Auralizer::create(AuralizerInput{}, options);
  ASSERT_TRUE(by_hand.ok() && by_script.ok());
  MovingSources& moving = *(*by_hand)->moving();
  EXPECT_EQ((*by_script)->moving(), nullptr) << "a script's sources are its own";
  std::optional<MovingHandle> car;
  const auto expected = heard(**by_hand, 1, [&](double t) {
    MovingSource source;
    source.position_m = {-10 + 30 * t, 0, -5};
    source.velocity_mps = {30, 0, 0};
    source.gain = same_in_all_bands(0.5f);
    source.start_s = 0.2;
    if (t >= 0.2 && !car) car = *moving.add(source);
    if (car && t < 0.6) (void)moving.move(*car, source.position_m, {30, 0, 0});
    if (car && t >= 0.6) (void)moving.remove(*car);
    moving.commit(t);
  });
  const auto scripted = heard(**by_script, 1, [](double) {});
  float peak = 0, difference = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    peak = std::max(peak, std::abs(expected[i]));
    difference = std::max(difference, std::abs(expected[i] - scripted[i]));
  }
  EXPECT_GT(peak, 0.01f);
  EXPECT_LT(difference, 1e-4f * peak);
  EXPECT_EQ(scripted.front(), 0);
  EXPECT_LT(std::abs(scripted.back()), 1e-6f);
}

TEST(MovingScript, SaysWhatIsWrongWithAFile) {
  const std::string path = written(R"({ "sources": [ { "signl": "noise", "path": {} } ] })");
  const auto script = MovingScript::read(path);
  std::filesystem::remove(path);
  ASSERT_FALSE(script.ok());
  EXPECT_NE(script.error().message.find("signl"), std::string::npos) << script.error().message;
  EXPECT_NE(script.error().message.find("source 1"), std::string::npos) << script.error().message;
}

}  // namespace
}  // namespace clamor
