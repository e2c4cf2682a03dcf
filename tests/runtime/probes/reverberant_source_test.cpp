// reverberant_source_test.cpp: moving sources as a listener hears them through probes.
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/files/random_access_file.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/engine/replaceable_signals.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/streaming/live_signal.h"
#include "runtime/streaming/prepared_signal.h"
#include "runtime/voices/keyframe.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

constexpr Vec3 kSourcePlace_m(2.4, 2.7, 1.4), kEarPlace_m(4.5, 6, 1.6);

Signal noise() {
  Signal signal{"noise", {}, true};
  for (std::uint32_t i = 0; i < 2 * kSampleRate_hz; ++i)
    signal.samples.push_back(static_cast<float>(unit(philox(3, {i, 0, 0, 0})[0]) - 0.5));
  return signal;
}

Level room(bool has_emitter) {
  Level level =
      testing::shoebox({6, 8, 3}, testing::uniform_material(0.15f, 0.5f, 8), kSourcePlace_m);
  level.signals = {noise()};
  if (!has_emitter) level.emitters.clear();
  return level;
}

// A bake of the room in a file, with probes around the place or an emitter at it.
class BakedFile {
 public:
  explicit BakedFile(bool has_probes) : path_("room.clamor") {
    BakeOptions options;
    options.settings.photons = 20'000;
    options.settings.sources = 40'000;
    if (has_probes)
      options.probes_m = {{1.5, 1.8, 1.5}, {1.5, 3.9, 1.5}, {3.6, 1.8, 1.5}, {3.6, 3.9, 1.5}};
    const auto contents = bake(room(!has_probes), options);
    EXPECT_TRUE(contents.ok());
    EXPECT_TRUE(write_bake(path_.path(), *contents, 1).ok());
  }
  std::shared_ptr<const BakeFile> open() const {
    auto file = BakeFile::open(path_.path());
    EXPECT_TRUE(file.ok());
    return std::make_shared<const BakeFile>(std::move(*file));
  }

 private:
  testing::TemporaryFile path_;
};

const BakedFile& with_probes() {
  static const BakedFile file(true);
  return file;
}

AuralizerOptions offline(std::size_t sources) {
  AuralizerOptions options;
  options.voices = 1500;
  options.wait_for_pages = true;
  options.moving.max_sources = sources;
  if (sources > 0) options.moving.kinds = {{"source", 0, {}}};
  return options;
}

// The left channel; before_keyframe(time_s) may move sources.
template <class Before>
std::vector<float> heard(Auralizer& auralizer, double seconds, Before before_keyframe) {
  std::vector<float> left, block(2 * kKeyframeFrames);
  while (static_cast<double>(left.size()) < seconds * kSampleRate_hz) {
    while (auralizer.wants_keyframe()) {
      before_keyframe(auralizer.next_keyframe_time_s());
      auralizer.make_keyframe({kEarPlace_m, 0, 0});
    }
    auralizer.mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
  }
  return left;
}

double power_db(std::span<const float> samples) {
  double sum = 0;
  for (const float sample : samples) sum += static_cast<double>(sample) * sample;
  return 10 * std::log10(sum / static_cast<double>(samples.size()) + 1e-30);
}

std::vector<float> render_moving_source(float reverberation, double seconds, double from_s) {
  auto auralizer = Auralizer::create(with_probes().open(), offline(1));
  EXPECT_TRUE(auralizer.ok()) << auralizer.error().message;
  MovingSource source;
  source.position_m = kSourcePlace_m;
  source.reverberation = reverberation;
  source.start_s = from_s;
  EXPECT_TRUE((*auralizer)->moving()->add(source).ok());
  return heard(**auralizer, seconds,
               [&](double time_s) { (*auralizer)->moving()->commit(time_s); });
}

// Rendered at its first use.
const std::vector<float>& of_moving_source(float reverberation, double seconds, double from_s = 0) {
  static std::map<std::tuple<float, double, double>, std::vector<float>> rendered;
  std::vector<float>& sound = rendered[{reverberation, seconds, from_s}];
  if (sound.empty()) sound = render_moving_source(reverberation, seconds, from_s);
  return sound;
}

TEST(ReverberantSource, IsAsLoudAsAnEmitterAtItsPlace_NoAsan) {
  const BakedFile baked(false);
  auto auralizer = Auralizer::create(baked.open(), offline(0));
  ASSERT_TRUE(auralizer.ok()) << auralizer.error().message;
  const auto emitter = heard(**auralizer, 2, [](double) {});
  const auto& moving = of_moving_source(1, 2);
  const auto& direct = of_moving_source(0, 2);
  // Both have random polarities, so their powers differ by some tenths of a decibel.
  EXPECT_NEAR(power_db(moving), power_db(emitter), 1);
  EXPECT_LT(power_db(direct), power_db(emitter) - 5);
}

TEST(ReverberantSource, HasReflectionsOfTheAmplitudeThatItIsGiven_NoAsan) {
  const double whole_db = power_db(of_moving_source(1, 2));
  const double direct = std::pow(10, power_db(of_moving_source(0, 2)) / 10);
  const double reflected = std::pow(10, whole_db / 10) - direct;
  const double half_db = power_db(of_moving_source(0.5f, 2));
  EXPECT_NEAR(half_db, 10 * std::log10(direct + reflected / 4), 0.5);
}

TEST(ReverberantSource, IsHeardWithItsRoomFromTheFirstKeyframesOn_NoAsan) {
  const auto& sound = of_moving_source(1, 1, 0.2);
  const auto part = [&](double from_s, double to_s) {
    return std::span(sound).subspan(static_cast<std::size_t>(from_s * kSampleRate_hz),
                                    static_cast<std::size_t>((to_s - from_s) * kSampleRate_hz));
  };
  EXPECT_LT(power_db(part(0, 0.19)), -100);
  // Within 50 ms of its beginning most of the room's energy has arrived.
  EXPECT_GT(power_db(part(0.25, 0.3)), power_db(part(0.7, 1)) - 4);
}

// In a diffuse field, what is left t after the end of a steady sound is exp(-13.8 t / T60) of it.
TEST(ReverberantSource, DiesAwayWhenItIsRemoved_NoAsan) {
  constexpr double kEnd_s = 1;
  // 144 m3 with 180 m2 of absorption 0.15 (Eyring).
  const double t60_s = 24 * std::log(10.0) / 343 * 144 / (-180 * std::log(1 - 0.15));
  auto auralizer = Auralizer::create(with_probes().open(), offline(2));
  ASSERT_TRUE(auralizer.ok());
  MovingSource source;
  source.position_m = kSourcePlace_m;
  auto handle = (*auralizer)->moving()->add(source);
  ASSERT_TRUE(handle.ok());
  bool is_present = true;
  const auto sound = heard(**auralizer, 6, [&](double time_s) {
    if (time_s >= kEnd_s && std::exchange(is_present, false)) {
      EXPECT_TRUE((*auralizer)->moving()->remove(*handle).ok());
      EXPECT_EQ((*auralizer)->moving()->size(), 0u);
    }
    (*auralizer)->moving()->commit(time_s);
  });
  const auto level_db = [&](double from_s, double to_s) {
    return power_db(
        std::span(sound).subspan(static_cast<std::size_t>(from_s * kSampleRate_hz),
                                 static_cast<std::size_t>((to_s - from_s) * kSampleRate_hz)));
  };
  const auto& direct = of_moving_source(0, 2);
  const double steady =
      std::pow(10, level_db(0.6, 1) / 10) -
      std::pow(10,
               power_db(std::span(direct).subspan(kSampleRate_hz / 2, kSampleRate_hz / 2)) / 10);
  for (const double after_s : {0.15, 0.3, 0.45}) {
    const double fallen_db = 10 * std::log10(steady) - 60 * (after_s + 0.05) / t60_s;
    EXPECT_NEAR(level_db(kEnd_s + after_s, kEnd_s + after_s + 0.1), fallen_db, 3) << after_s;
  }
  EXPECT_LT(level_db(5.8, 6), -150);
}

// Slots are used again so late that a gun's shots reverberate, and at once where all are in use.
TEST(ReverberantSource, GivesItsSlotToAnotherAtAnyTime) {
  auto auralizer = Auralizer::create(with_probes().open(), offline(1));
  ASSERT_TRUE(auralizer.ok());
  MovingSources& moving = *(*auralizer)->moving();
  std::optional<MovingHandle> shot;
  const auto sound = heard(**auralizer, 1, [&](double time_s) {
    if (shot) {
      EXPECT_TRUE(moving.remove(*shot).ok());
    }
    MovingSource source;
    source.position_m = kSourcePlace_m + Vec3(time_s, 0, 0);
    const auto added = moving.add(source);
    ASSERT_TRUE(added.ok());
    shot = *added;
    moving.commit(time_s);
  });
  for (const float sample : sound) ASSERT_TRUE(std::isfinite(sample));
}

// In a wall, outside the room, as far away as can be: no reflections, and the statistics tell.
TEST(ReverberantSource, HasNoReflectionsWhereThereIsNoRoom) {
  auto auralizer = Auralizer::create(with_probes().open(), offline(6));
  ASSERT_TRUE(auralizer.ok());
  MovingSource source;
  source.position_m = kSourcePlace_m;
  const auto handle = (*auralizer)->moving()->add(source);
  ASSERT_TRUE(handle.ok());
  const auto is_finite_now = [&](double seconds) {
    for (const float sample : heard(**auralizer, seconds,
                                    [&](double time_s) { (*auralizer)->moving()->commit(time_s); }))
      if (!std::isfinite(sample)) return false;
    return true;
  };
  EXPECT_TRUE(is_finite_now(0.2));
  EXPECT_EQ((*auralizer)->statistics().unseen_sources, 0u);
  for (const Vec3& place_m :
       {Vec3(3, -1, 1.5), Vec3(-1, 4, 1.5), Vec3(1e6, 0, 0), Vec3(-1e6, 1e6, -1e6)}) {
    source.position_m = place_m;
    ASSERT_TRUE((*auralizer)->moving()->add(source).ok());
  }
  EXPECT_TRUE(is_finite_now(0.2));
  EXPECT_EQ((*auralizer)->statistics().unseen_sources, 4u);
  // One that goes there keeps its reflections for 0.4 s at most.
  ASSERT_TRUE((*auralizer)->moving()->move(*handle, {-0.5, 2.7, 1.4}).ok());
  EXPECT_TRUE(is_finite_now(0.6));
  EXPECT_EQ((*auralizer)->statistics().unseen_sources, 5u);
  ASSERT_TRUE((*auralizer)->moving()->move(*handle, kSourcePlace_m).ok());
  EXPECT_TRUE(is_finite_now(0.2));
  EXPECT_EQ((*auralizer)->statistics().unseen_sources, 4u);
  EXPECT_EQ((*auralizer)->statistics().max_unseen_sources, 5u);
}

// No photon of theirs has met a surface.
TEST(ReverberantSource, IsHeardDirectlyWhereProbesHaveNoReflections) {
  Level level = room(false);
  level.mesh = {};
  BakeOptions baking{.settings = {.photons = 100}};
  baking.probes_m = {{1.5, 1.8, 1.5}, {3.6, 3.9, 1.5}};
  const auto contents = bake(level, baking);
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  const auto file = testing::as_file(*contents);
  const auto played = [&](bool reverberates) {
    AuralizerOptions options = offline(1);
    options.moving.reverberates = reverberates;
    auto auralizer = Auralizer::create(file, options);
    EXPECT_TRUE(auralizer.ok()) << auralizer.error().message;
    MovingSource source;
    source.position_m = kSourcePlace_m;
    EXPECT_TRUE((*auralizer)->moving()->add(source).ok());
    return heard(**auralizer, 0.3, [&](double time_s) { (*auralizer)->moving()->commit(time_s); });
  };
  const auto with = played(true);
  EXPECT_GT(power_db(with), -60);
  EXPECT_EQ(with, played(false));
}

// Each of a crowd is heard through one or two reflections; together they have the right level in
// any bake. If all copies of a probe's tree chose alike, 1.3 dB would be missing on average, and
// single bakes would differ by twice that.
TEST(ReverberantSource, AddsUpInACrowdThatHasFewVoices_NoAsan) {
  const auto crowd_power = [](const BakedFile& baked, int voices) {
    AuralizerOptions options = offline(150);
    options.voices = voices;
    auto auralizer = Auralizer::create(baked.open(), options);
    EXPECT_TRUE(auralizer.ok());
    for (std::uint32_t i = 0; i < 150; ++i) {
      const RandomBits bits = philox(4, {i, 0, 0, 0});
      MovingSource source;
      source.position_m = {1 + 3 * unit(bits[0]), 1 + 3 * unit(bits[1]), 1.5};
      source.start_s = -2 * unit(bits[2]);
      EXPECT_TRUE((*auralizer)->moving()->add(source).ok());
    }
    const auto sound =
        heard(**auralizer, 1, [&](double time_s) { (*auralizer)->moving()->commit(time_s); });
    return std::pow(10, power_db(sound) / 10);
  };
  const double few = crowd_power(with_probes(), 300), all = crowd_power(with_probes(), 12'000);
  EXPECT_NEAR(10 * std::log10(few / all), 0, 0.8);
}

// One that starts at a time and moves with a velocity, with many voices or as a field. Without
// occlusion, whose estimates improve with time.
std::vector<float> mixed_source(Mixing mixing, double start_s, const Vec3& velocity_mps) {
  AuralizerOptions options = offline(1);
  options.visibility = false;
  options.voices = 6000;
  options.mixing = mixing;
  auto auralizer = Auralizer::create(with_probes().open(), options);
  EXPECT_TRUE(auralizer.ok()) << auralizer.error().message;
  MovingSources& moving = *(*auralizer)->moving();
  MovingSource source;
  source.position_m = kSourcePlace_m;
  source.velocity_mps = velocity_mps;
  source.start_s = start_s;
  const auto handle = moving.add(source);
  auto sound = heard(**auralizer, 1.2, [&](double time_s) {
    EXPECT_TRUE(moving.move(*handle, kSourcePlace_m + time_s * velocity_mps, velocity_mps).ok());
    moving.commit(time_s);
  });
  const auto statistics = (*auralizer)->statistics();
  if (mixing == Mixing::kField) {
    EXPECT_GT(statistics.taps, 3000u);
    EXPECT_LT(statistics.voices, 3000u);
  }
  return sound;
}

double difference_db(std::span<const float> exact, std::span<const float> other) {
  std::vector<float> difference;
  for (std::size_t i = 0; i < exact.size(); ++i) difference.push_back(other[i] - exact[i]);
  return power_db(difference) - power_db(exact);
}

// With each keyframe the noise is a little louder or quieter and the sample another one; taps take
// its factors less often than voices.
TEST(ReverberantSource, SoundsAlikeWhereItsReflectionsAreTaps_NoAsan) {
  const auto voices = mixed_source(Mixing::kVoices, 0, {}),
             field = mixed_source(Mixing::kField, 0, {});
  constexpr std::size_t kSettled = kSampleRate_hz * 7 / 10;
  EXPECT_LT(difference_db(std::span(voices).subspan(kSettled), std::span(field).subspan(kSettled)),
            -25);
  EXPECT_LT(difference_db(voices, field), -25);
}

// Voices begin with their sound; only then do they become taps.
TEST(ReverberantSource, BeginsAtItsTimeWhereItsReflectionsAreTaps_NoAsan) {
  const auto voices = mixed_source(Mixing::kVoices, 0.2, {}),
             field = mixed_source(Mixing::kField, 0.2, {});
  EXPECT_LT(power_db(std::span(field).first(kSampleRate_hz * 19 / 100)), -100);
  EXPECT_LT(difference_db(voices, field), -25);
}

// Plays a source whose signal may be replaced.
std::unique_ptr<Auralizer> with_a_slot(Mixing mixing) {
  AuralizerOptions options = offline(1);
  options.voices = 6000;
  options.visibility = false;
  options.mixing = mixing;
  options.moving.kinds = {};
  options.moving.signal_slots = 1;
  auto auralizer = Auralizer::create(with_probes().open(), options);
  EXPECT_TRUE(auralizer.ok()) << auralizer.error().message;
  return std::move(*auralizer);
}

// Samples that have not arrived are not read, though the mixer reads the signals of taps ahead.
TEST(ReverberantSource, OfALiveSignalSoundsAlikeWhereItsReflectionsAreTaps_NoAsan) {
  const auto heard_live = [](Mixing mixing) {
    const auto auralizer = with_a_slot(mixing);
    const auto live = std::make_shared<LiveSignal>(auralizer->mode());
    const Bands weights = same_in_all_bands(1);
    auralizer->set_signal(0, {std::shared_ptr<const PreparedSignal>(live, &live->signal()), nullptr,
                              LoudnessTrack(weights, weights)});
    auralizer->set_kind(0, 0, {});
    MovingSource source;
    source.position_m = kSourcePlace_m;
    EXPECT_TRUE(auralizer->moving()->add(source).ok());
    const Signal whole = noise();
    std::size_t arrived = 0;
    auto sound = heard(*auralizer, 1.2, [&](double time_s) {
      while (static_cast<double>(live->end()) < (time_s + 0.04) * kSampleRate_hz) {
        live->append(std::span(whole.samples).subspan(arrived, 480));
        arrived += 480;
      }
      auralizer->moving()->commit(time_s);
    });
    EXPECT_EQ(auralizer->statistics().late_voices, 0u);
    EXPECT_EQ(auralizer->statistics().taps > 1000, mixing == Mixing::kField);
    return sound;
  };
  const auto voices = heard_live(Mixing::kVoices), field = heard_live(Mixing::kField);
  constexpr std::size_t kSettled = kSampleRate_hz * 7 / 10;
  EXPECT_LT(difference_db(std::span(voices).subspan(kSettled), std::span(field).subspan(kSettled)),
            -35);
}

// A slot's signal is replaced once nothing reads it, spectra of the field's blocks included.
TEST(ReverberantSource, TakesANewSignalWhereItsReflectionsAreTaps_NoAsan) {
  const auto heard_after = [](Mixing mixing) {
    const auto auralizer = with_a_slot(mixing);
    MovingSources& moving = *auralizer->moving();
    std::optional<MovingHandle> playing;
    const auto play = [&](Signal signal) {
      const Bands weights = same_in_all_bands(1);
      auralizer->set_signal(0, {std::make_shared<const PreparedSignal>(signal, auralizer->mode()),
                                nullptr, LoudnessTrack(weights, weights)});
      auralizer->set_kind(0, 0, {});
      MovingSource source;
      source.position_m = kSourcePlace_m;
      playing = *moving.add(source);
    };
    Signal other = noise();
    for (std::size_t i = 0; i + 1 < other.samples.size(); i += 2)
      std::swap(other.samples[i], other.samples[i + 1]);
    play(other);
    bool is_cleared = false;
    return heard(*auralizer, 2.4, [&](double time_s) {
      if (time_s > 0.3 && playing && !is_cleared) {
        EXPECT_TRUE(moving.remove(*playing).ok());
        playing.reset();
      }
      if (time_s > 0.9 && !std::exchange(is_cleared, true)) auralizer->clear_signal(0);
      if (is_cleared && !playing && auralizer->signal_slots().is_free(0)) play(noise());
      moving.commit(time_s);
    });
  };
  const auto voices = heard_after(Mixing::kVoices), field = heard_after(Mixing::kField);
  constexpr std::size_t kSettled = kSampleRate_hz * 2;
  EXPECT_GT(power_db(std::span(voices).subspan(kSettled)), -60);
  EXPECT_LT(difference_db(std::span(voices).subspan(kSettled), std::span(field).subspan(kSettled)),
            -35);
}

TEST(ReverberantSource, IsAsLoudWhereItMovesAndItsReflectionsAreTaps_NoAsan) {
  const Vec3 velocity_mps(0.6, 0.8, 0);
  const auto voices = mixed_source(Mixing::kVoices, 0, velocity_mps),
             field = mixed_source(Mixing::kField, 0, velocity_mps);
  constexpr std::size_t kWindow = kSampleRate_hz * 2 / 5, kHop = kWindow / 4;
  for (std::size_t at = 0; at + kWindow <= voices.size(); at += kHop)
    EXPECT_NEAR(power_db(std::span(field).subspan(at, kWindow)),
                power_db(std::span(voices).subspan(at, kWindow)), 0.5)
        << at;
}

}  // namespace
}  // namespace clamor
