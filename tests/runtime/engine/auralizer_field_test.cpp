// Sources as taps of a field sound as they do as voices (field_maker.h).
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/mixing/field_maker.h"
#include "tests/runtime/scattered_sources.h"
#include "tests/sanitized.h"
#include "tools/strategies/strategies.h"

namespace clamor {
namespace {

// Far more sources than a field has voices.
constexpr std::uint32_t kSources = testing::kSanitized ? 400 : 4000;

Signal sine(double frequency_hz, std::size_t frames = kSampleRate_hz / 2) {
  Signal signal;
  signal.loop = true;
  for (std::size_t i = 0; i < frames; ++i)
    signal.samples.push_back(
        static_cast<float>(0.5 * std::sin(2 * std::numbers::pi * frequency_hz *
                                          static_cast<double>(i) / kSampleRate_hz)));
  return signal;
}

// A room of 8 m whose sound decays by 60 dB in half a second. Its emitters play two tones and a
// click, which begins after 0.2 s and plays once.
AuralizerInput room() {
  constexpr double kDecay_s = 0.5;
  testing::ScatteredSources scattered(1, kSources, 8, {4, 4, 1.5});
  std::uint32_t number = 0;
  for (Source& source : scattered.sources) {
    source.patch_radius_m = std::max(source.patch_radius_m, 0.3f);
    if (source.is_emitter) continue;
    const RandomBits bits = philox(2, {number++, 0, 0, 0});
    source.delay_s = static_cast<float>(0.01 + kDecay_s * unit(bits[0]));
    source.polarity = bits[1] % 2 == 0 ? 1 : -1;
    for (float& band : source.power)
      band *= static_cast<float>(std::pow(10, -6 * static_cast<double>(source.delay_s) / kDecay_s));
  }
  for (std::size_t e = 0; e < scattered.emitters.size(); ++e) {
    scattered.emitters[e].signal = static_cast<std::uint32_t>(e % 3);
    scattered.emitters[e].delay_s = 0.1 * static_cast<double>(e % 3);
  }
  return {std::move(scattered.sources),
          std::move(scattered.emitters),
          {sine(440), sine(997), {"click", {1.0f, 0.5f, -0.25f}, false}},
          std::move(scattered.materials),
          Air()};
}

OutputFormat binaural() {
  OutputFormat format;
  format.kind = OutputFormat::Kind::kBinaural;
  format.head = *Hrtf::read("");
  return format;
}

AuralizerOptions everything(Mixing mixing, const OutputFormat& output = {}) {
  AuralizerOptions options;
  options.voices = 1'000'000;
  options.mixing = mixing;
  options.output = output;
  options.visibility = false;
  return options;
}

// The room with loops of noise in place of its two tones and its click.
AuralizerInput room_of_noise() {
  AuralizerInput input = room();
  std::minstd_rand random(1);
  std::uniform_real_distribution<float> uniform(-0.5f, 0.5f);
  for (Signal& signal : input.signals) {
    signal.samples.resize(kSampleRate_hz / 2);
    for (float& sample : signal.samples) sample = uniform(random);
    signal.loop = true;
  }
  return input;
}

template <class ListenerAt>
std::vector<float> mixed(const AuralizerOptions& options, double seconds,
                         const ListenerAt& listener_at, int block_frames = 960,
                         AuralizerInput input = room()) {
  const auto made = Auralizer::create(std::move(input), options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  Auralizer& auralizer = **made;
  const auto channels = static_cast<std::size_t>(auralizer.channels());
  std::vector<float> all(channels *
                         static_cast<std::size_t>(std::lround(seconds * kSampleRate_hz)));
  for (std::size_t done = 0; done < all.size();) {
    while (auralizer.wants_keyframe())
      auralizer.make_keyframe(listener_at(auralizer.next_keyframe_time_s()));
    const std::size_t samples =
        std::min(all.size() - done, channels * static_cast<std::size_t>(block_frames));
    auralizer.mix(std::span(all).subspan(done, samples));
    done += samples;
  }
  return all;
}

double power(std::span<const float> samples) {
  double sum = 0;
  for (const float x : samples) sum += static_cast<double>(x) * static_cast<double>(x);
  return sum;
}

// Of the difference, relative to the first, in decibels.
double error_db(const std::vector<float>& exact, const std::vector<float>& other) {
  std::vector<float> difference;
  for (std::size_t i = 0; i < exact.size(); ++i) difference.push_back(other[i] - exact[i]);
  return 10 * std::log10(power(difference) / power(exact));
}

constexpr auto kStanding = [](double) { return Listener({4, 5, 1.6}, 0.4, 0); };

TEST(AuralizerField, EqualsAllVoicesWhereTheListenerStands_NoTsan) {
  const std::vector<std::pair<std::string, OutputFormat>> formats = {
      {"two receivers", {}},
      {"stereo loudspeakers", *OutputFormat::from_options(false, "stereo", false)},
      {"5.1", *OutputFormat::from_options(false, "5.1", false)},
      {"7.1.4", *OutputFormat::from_options(false, "7.1.4", false)},
      {"ambisonics", *OutputFormat::from_options(false, "", true)},
      {"binaural", binaural()}};
  for (const auto& [name, format] : formats) {
    SCOPED_TRACE(name);
    const auto heard = [&output = format](Mixing mixing) {
      return mixed(everything(mixing, output), 0.3, kStanding, 960, room_of_noise());
    };
    EXPECT_LT(error_db(heard(Mixing::kVoices), heard(Mixing::kField)), -40);
  }
}

// The room's click plays once, 0.2 s after the tones, and each of its reflections is a tap.
TEST(AuralizerField, PlaysAOneShotAtItsTime_NoTsan) {
  const auto only_click = [](Mixing mixing) {
    AuralizerInput input = room();
    for (Signal& signal : input.signals)
      if (signal.loop) std::ranges::fill(signal.samples, 0.0f);
    return mixed(everything(mixing), 0.4, kStanding, 960, std::move(input));
  };
  EXPECT_LT(error_db(only_click(Mixing::kVoices), only_click(Mixing::kField)), -40);
}

// Sources become voices and taps as their ranks change, and both are heard at once meanwhile. At
// this pace a response is hardly another than the one before.
TEST(AuralizerField, PassesSourcesBetweenVoicesAndTapsWithoutAChange_NoAsan_NoTsan) {
  const auto creeping = [](double t) { return Listener({4 - 0.05 * t, 5, 1.6}, 0.4, 0); };
  const auto voices = mixed(everything(Mixing::kVoices), 2, creeping);
  const double e = error_db(voices, mixed(everything(Mixing::kField), 2, creeping));
  EXPECT_LT(e, -30);
}

void expect_same_loudness(std::span<const float> field, std::span<const float> voices) {
  constexpr std::size_t kWindow = 2 * 19'200, kHop = kWindow / 4;  // 400 ms, 100 ms
  for (std::size_t at = 0; at + kWindow <= voices.size(); at += kHop)
    EXPECT_NEAR(
        10 * std::log10(power(field.subspan(at, kWindow)) / power(voices.subspan(at, kWindow))), 0,
        0.5)
        << at / 2;
}

// Two steady tones: the hardest signals, because all of a tone's sources interfere.
TEST(AuralizerField, IsAsLoudAsAllVoicesForAWalkingListener_NoAsan_NoTsan) {
  const auto walking = [](double t) {
    return Listener({3 + 1.5 * std::sin(t), 4 + 1.5 * std::cos(t), 1.5}, 0.3 * t, 0);
  };
  constexpr double kSeconds = 4;
  const auto voices = mixed(everything(Mixing::kVoices), kSeconds, walking);
  const auto field = mixed(everything(Mixing::kField), kSeconds, walking);
  expect_same_loudness(field, voices);
}

// The room's sources play twenty tones, none of which is much of the whole: a response is kept
// while the listener walks and turns.
TEST(AuralizerField, IsAsLoudWhereItKeepsResponsesOfManySignals_NoAsan_NoTsan) {
  AuralizerInput input = room();
  const Emitter emitter = input.emitters[0];
  input.emitters.clear();
  input.signals.clear();
  for (std::uint32_t signal = 0; signal < 20; ++signal) {
    input.signals.push_back(sine(200 * std::pow(1.15, signal)));
    input.emitters.push_back(emitter);
    input.emitters.back().signal = signal;
  }
  for (std::size_t i = 0; i < input.sources.size(); ++i) {
    input.sources[i].emitter = static_cast<std::uint32_t>(i % input.emitters.size());
    input.sources[i].is_emitter = input.sources[i].is_image = false;
  }
  const auto walking = [](double t) {
    return Listener({3 + 1.5 * std::sin(t), 4 + 1.5 * std::cos(t), 1.5}, 0.8 * t, 0);
  };
  const auto heard = [&](Mixing mixing) {
    return mixed(everything(mixing, binaural()), 3, walking, 960, input);
  };
  const auto voices = heard(Mixing::kVoices), field = heard(Mixing::kField);
  expect_same_loudness(field, voices);
}

// The click begins after 0.2 s; its sound is dense from a tenth of a second after that on.
TEST(AuralizerField, HasDenseLateSoundOfTheSamePowerIfAsked_NoAsan_NoTsan) {
  AuralizerInput input = room();
  for (Signal& signal : input.signals)
    if (signal.loop) std::ranges::fill(signal.samples, 0.0f);
  AuralizerOptions options = everything(Mixing::kField);
  const auto stored = mixed(options, 0.7, kStanding, 960, input);
  options.has_dense_late = true;
  const auto dense = mixed(options, 0.7, kStanding, 960, input);
  constexpr std::size_t kEarly = 2 * kSampleRate_hz * 28 / 100;
  EXPECT_LT(
      error_db({stored.begin(), stored.begin() + kEarly}, {dense.begin(), dense.begin() + kEarly}),
      -50);
  const auto late = [](const std::vector<float>& sound) {
    return std::span(sound).subspan(2 * kSampleRate_hz * 4 / 10, 2 * kSampleRate_hz / 4);
  };
  EXPECT_NE(std::vector(late(stored).begin(), late(stored).end()),
            std::vector(late(dense).begin(), late(dense).end()));
  EXPECT_NEAR(10 * std::log10(power(late(dense)) / power(late(stored))), 0, 1);
}

TEST(AuralizerField, RendersTheSameSamplesForAnyBlockSizes_NoTsan) {
  const auto walking = [](double t) { return Listener({3 + t, 4, 1.5}, 0.7 * t, 0); };
  AuralizerOptions options = everything(Mixing::kField);
  options.block_frames = 2048;
  const auto regular = mixed(options, 0.3, walking);
  for (const int frames : {64, 333, 2048})
    EXPECT_EQ(regular, mixed(options, 0.3, walking, frames)) << frames;
}

// The sampler makes responses while the audio thread plays others; ThreadSanitizer watches.
TEST(AuralizerField, HandsResponsesFromThreadToThread) {
  const auto made = Auralizer::create(room(), everything(Mixing::kField, binaural()));
  ASSERT_TRUE(made.ok()) << made.error().message;
  Auralizer& auralizer = **made;
  std::atomic<bool> done{false};
  double power_of_all = 0;
  std::thread audio([&] {
    std::vector<float> block(2 * 480);
    while (auralizer.statistics().keyframes < 60) {
      auralizer.mix(block);
      power_of_all += power(block);
    }
    done = true;
  });
  while (!done)
    if (auralizer.wants_keyframe())
      auralizer.make_keyframe(Listener({4 - 2 * auralizer.next_keyframe_time_s(), 5, 1.6}, 0.4, 0));
  audio.join();
  EXPECT_GT(power_of_all, 0);
  EXPECT_TRUE(std::isfinite(power_of_all));
}

TEST(AuralizerField, IsRefusedWhereItCannotBe_NoTsan) {
  AuralizerOptions options = everything(Mixing::kField);
  options.strategy = make_strategy("all");
  EXPECT_FALSE(Auralizer::create(room(), options).ok());
  options.mixing = Mixing::kAuto;
  EXPECT_TRUE(Auralizer::create(room(), options).ok());
  options.has_dense_late = true;
  EXPECT_FALSE(Auralizer::create(room(), options).ok());
  options = everything(Mixing::kVoices);
  options.has_dense_late = true;
  EXPECT_FALSE(Auralizer::create(room(), options).ok());
}

// Otherwise whoever asks for dense late sound of a small sample would not get it, nor learn why.
TEST(AuralizerField, IsMixedForDenseLateSoundHoweverFewTheSources_NoTsan) {
  AuralizerOptions options = everything(Mixing::kAuto);
  options.voices = 300;
  options.has_dense_late = true;
  const auto dense = mixed(options, 0.1, kStanding);
  options.mixing = Mixing::kField;
  EXPECT_EQ(dense, mixed(options, 0.1, kStanding));
}

// Where sources may move, a signal that so few play would otherwise be voices, and not dense.
TEST(AuralizerField, MakesDenseWhatFewSourcesPlayBesideMovingOnes_NoAsan_NoTsan) {
  AuralizerOptions options = everything(Mixing::kField);
  options.voices = 300;
  options.moving.max_sources = 1;
  const auto stored = mixed(options, 0.4, kStanding);
  options.has_dense_late = true;
  EXPECT_NE(stored, mixed(options, 0.4, kStanding));
}

// Half of the room's sources are emitters' of their own, which begin one after the other.
AuralizerInput crowd(double spacing_s) {
  AuralizerInput input = room_of_noise();
  const Emitter emitter = input.emitters[0];
  for (std::size_t i = 0; i < input.sources.size(); i += 2) {
    input.sources[i].emitter = static_cast<std::uint32_t>(input.emitters.size());
    input.emitters.push_back(emitter);
    input.emitters.back().delay_s = spacing_s * static_cast<double>(i);
  }
  return input;
}

// A response for each time at which one of them begins would not pay: they are voices, and the
// others taps.
TEST(AuralizerField, LeavesACrowdThatBeginsAtManyTimesToVoices_NoAsan_NoTsan) {
  AuralizerOptions options = everything(Mixing::kField);
  const auto voices = mixed(everything(Mixing::kVoices), 0.6, kStanding, 960, crowd(0.02));
  EXPECT_LT(error_db(voices, mixed(options, 0.6, kStanding, 960, crowd(0.02))), -40);
  options.mixing = Mixing::kAuto;
  EXPECT_EQ(voices, mixed(options, 0.6, kStanding, 960, crowd(0.02)));
}

// All begin within 0.3 s, so that those of a signal share a response.
TEST(AuralizerField, SumsUpACrowdThatBeginsAlmostAtOnce_NoAsan_NoTsan) {
  constexpr double kSpacing_s = 0.3 / kSources;
  AuralizerOptions options = everything(Mixing::kField);
  const auto voices = mixed(everything(Mixing::kVoices), 0.6, kStanding, 960, crowd(kSpacing_s));
  const auto field = mixed(options, 0.6, kStanding, 960, crowd(kSpacing_s));
  EXPECT_NE(voices, field);
  EXPECT_LT(error_db(voices, field), -40);
  options.mixing = Mixing::kAuto;
  EXPECT_EQ(field, mixed(options, 0.6, kStanding, 960, crowd(kSpacing_s)));
}

// Loops of which four do not divide the length are kept at a quarter of the rate as well.
TEST(AuralizerField, ReadsTheLowLayerOfALoopAcrossItsEnd_NoTsan) {
  for (const std::size_t frames : {24'000u, 24'001u, 24'002u, 24'003u}) {
    Signal signal = sine(100);
    signal.samples.resize(frames);
    for (std::size_t i = 0; i < frames; ++i)
      signal.samples[i] = static_cast<float>(std::sin(
          2 * std::numbers::pi * 50 * static_cast<double>(i) / static_cast<double>(frames)));
    const PreparedSignal prepared(signal, MixMode{.head = true});  // whose phase is kept
    std::vector<float> low(64);
    prepared.read_low(static_cast<std::int64_t>(frames) - 129, low);
    for (std::size_t k = 0; k < low.size(); ++k)
      EXPECT_NEAR(low[k],
                  std::sin(2 * std::numbers::pi * 50 * (4.0 * static_cast<double>(k) - 129) /
                           static_cast<double>(frames)),
                  1e-4)
          << frames << ' ' << k;
  }
}

}  // namespace
}  // namespace clamor
