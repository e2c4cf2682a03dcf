// Tests of what displays and editors ask of an auralizer: that another one goes on where it is,
// that parts of the sound are heard alone, and which sources it chose.
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_crossfade.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/heard_source.h"
#include "runtime/engine/solo_settings.h"
#include "runtime/voices/keyframe.h"
#include "tests/baked_room.h"
#include "tests/temporary_file.h"

namespace clamor::testing {
namespace {

const Listener kListener{{4, 5, 1.6}, 0.5, 0};
constexpr std::size_t kChannels = 2;

std::unique_ptr<Auralizer> auralizer_of(AuralizerOptions options, double begins_s = 0) {
  AuralizerInput input = baked_room();
  input.signals[2] = sine(310);  // a click would begin anew
  options.voices = 300;
  options.begins_s = begins_s;
  options.keeps_sample = true;
  auto made = Auralizer::create(std::move(input), options);
  EXPECT_TRUE(made.ok());
  return std::move(*made);
}

void make_keyframes(Auralizer& auralizer) {
  while (auralizer.wants_keyframe()) auralizer.make_keyframe(kListener);
}

std::vector<float> played(Auralizer& auralizer, std::size_t frames) {
  std::vector<float> all(frames * kChannels);
  for (std::size_t at = 0; at < frames; at += 240) {
    make_keyframes(auralizer);
    auralizer.mix(std::span(all).subspan(at * kChannels, 240 * kChannels));
  }
  return all;
}

double difference(std::span<const float> a, std::span<const float> b) {
  double greatest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    greatest = std::max(greatest, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
  return greatest;
}

double loudest(std::span<const float> samples) {
  double greatest = 0;
  for (const float sample : samples)
    greatest = std::max(greatest, std::abs(static_cast<double>(sample)));
  return greatest;
}

// A fade to an auralizer that plays the same, and is in step, changes nothing: one that begins with
// the fade, or that began before and has skipped what was played since.
TEST(AuralizerHandOver, GoesOnWhereLoopsAre) {
  constexpr std::size_t kFrames = 24'000, kFrom = 8 * kKeyframeFrames;
  const auto undisturbed = auralizer_of({});
  const std::vector<float> expected = played(*undisturbed, kFrames);
  EXPECT_GT(difference(std::span(expected).subspan(2 * kFrom),
                       std::span(expected).first(2 * (kFrames - kFrom))),
            0.2 * loudest(expected))
      << "the test would not see a sound that begins anew";

  for (const std::size_t skipped : {std::size_t{0}, std::size_t{5} * kKeyframeFrames}) {
    const auto first = auralizer_of({});
    const auto second = auralizer_of({}, static_cast<double>(kFrom - skipped) / kSampleRate_hz);
    second->warm_up(kListener);
    second->skip(skipped);
    AuralizerCrossfade crossfade(*first);
    std::vector<float> heard(kFrames * kChannels);
    for (std::size_t at = 0; at < kFrames; at += 240) {
      make_keyframes(*first);
      make_keyframes(*second);
      if (at == 6'000) crossfade.fade_to(*second, kFrom);
      crossfade.mix(std::span(heard).subspan(at * kChannels, 240 * kChannels));
    }
    EXPECT_TRUE(crossfade.has_faded());
    // Samples are drawn for the same moments, so that only rounding differs.
    EXPECT_LT(difference(heard, expected), 1e-4 * loudest(expected)) << skipped << " skipped";
  }
}

std::vector<std::uint64_t> first_sample(Auralizer& auralizer) {
  auralizer.make_keyframe(kListener);
  std::vector<std::uint64_t> numbers;
  for (const HeardSource& heard : auralizer.newest_sample()) numbers.push_back(heard.number);
  return numbers;
}

// One that waits for pages chooses from all sources, as does one that was warmed up.
TEST(AuralizerHandOver, HasAllPagesInItsFirstKeyframeOnceItIsWarmedUp) {
  const auto file = as_file(baked_contents(3000));
  AuralizerOptions options;
  options.voices = 300;
  options.visibility = false;
  options.keeps_sample = true;
  const auto cold = Auralizer::create(file, options), warm = Auralizer::create(file, options);
  options.wait_for_pages = true;
  const auto waiting = Auralizer::create(file, options);
  ASSERT_TRUE(cold.ok() && warm.ok() && waiting.ok());
  (*warm)->warm_up(kListener);
  const auto expected = first_sample(**waiting);
  EXPECT_EQ(first_sample(**warm), expected);
  EXPECT_NE(first_sample(**cold), expected) << "the test would not see pages that are missing";
}

std::vector<float> focused(const SoloSettings& focus) {
  const auto auralizer = auralizer_of({});
  auralizer->set_focus(focus);
  return played(*auralizer, 4'800);
}

TEST(SoloSettings, PartsAddUpToTheWhole) {
  const std::vector<float> whole = focused({});
  std::vector<float> sum(whole.size());
  for (std::size_t part = 0; part < kSoundParts; ++part) {
    SoloSettings focus;
    focus.parts = {};
    focus.parts[part] = 1;
    const std::vector<float> alone = focused(focus);
    EXPECT_GT(loudest(alone), 0.01 * loudest(whole)) << part;
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += alone[i];
  }
  EXPECT_LT(difference(sum, whole), 1e-3 * loudest(whole));
}

TEST(SoloSettings, BandsAddUpToTheWhole_NoAsan) {
  const std::vector<float> whole = focused({});
  std::vector<float> sum(whole.size());
  for (std::size_t band = 0; band < kBandCount; ++band) {
    SoloSettings focus;
    focus.bands = {};
    focus.bands[band] = 1;
    const std::vector<float> alone = focused(focus);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += alone[i];
  }
  EXPECT_LT(difference(sum, whole), 1e-3 * loudest(whole));
}

TEST(AuralizerSample, TellsWhatWasChosenAndItsPart) {
  const auto auralizer = auralizer_of({});
  EXPECT_TRUE(auralizer->newest_sample().empty());
  auralizer->make_keyframe(kListener);
  const auto heard = auralizer->newest_sample();
  ASSERT_GT(heard.size(), 50u);
  const auto direct = std::ranges::count(heard, SoundPart::kDirect, &HeardSource::part);
  EXPECT_EQ(direct, 3);
  for (const HeardSource& source : heard) {
    EXPECT_EQ(source.power_gain, 1) << "nothing occludes in a list of sources";
    EXPECT_GE(source.power, 0);
  }
}

}  // namespace
}  // namespace clamor::testing
