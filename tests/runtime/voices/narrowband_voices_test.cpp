// narrowband_voices_test.cpp: among many voices, the loudest have narrow HRTF bands and the others
// octaves.
#include "runtime/voices/narrowband_voices.h"

#include <random>

#include <gtest/gtest.h>

#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

using namespace testing;

MixMode with_narrowband_voices(int narrowband_voices) {
  MixMode mode = kBinaural;
  mode.narrowband_voices = narrowband_voices;
  return mode;
}

// Both ears, `frames` frames; keyframe(k) returns keyframe k.
template <class Next>
std::array<std::vector<float>, kEars> mixed_crowd(const Hrtf& head,
                                                  const std::vector<Signal>& sounds,
                                                  const MixMode& mode, std::size_t slots,
                                                  int frames, Next keyframe) {
  const auto signals = prepare_signals(sounds, mode);
  Mixer mixer(signals, slots, mode, nullptr, &head);
  return heard_of(mixer, frames, keyframe);
}

Keyframe keyframe_of(std::vector<Voice> voices) {
  Keyframe keyframe;
  for (std::uint32_t v = 0; v < voices.size(); ++v) voices[v].slot = v;
  keyframe.voices = std::move(voices);
  return keyframe;
}

Signal noisy_signal(unsigned seed, std::size_t frames) {
  Signal sound;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-0.5f, 0.5f);
  for (std::size_t i = 0; i < frames; ++i) sound.samples.push_back(uniform(random));
  return sound;
}

// Mean energy of an octave's ERB bands, relative to `common`; the last octave extends to 17 kHz.
double octave_db(const ErbBands& energy, const ErbBands& common, std::size_t octave) {
  double sum = 0, count = 0;
  for (std::size_t b = 0; b < kErbBandCount; ++b)
    if (const double off = std::log2(erb_band_centre_hz(b) / kBandCentres_hz[octave]);
        off > -0.5 && (off < 0.5 || octave + 1 == kBandCount)) {
      sum += energy[b] / common[b];
      ++count;
    }
  return 10 * std::log10(sum / count);
}

// The time between the ears is tested in interaural_times_test.cpp.
TEST(NarrowbandVoices, LeaveTheOtherVoicesTheirOctaveLevels) {
  std::vector<std::array<ErbBands, kEars>> ours, direct;
  ErbBands common{}, our_common{};
  const MixMode mode = with_narrowband_voices(0);
  for (const std::size_t d : two_hundred()) {
    const auto& out = mixed_click(d, mode);
    std::array<Spectrum, kEars> spectra, measured;
    ours.emplace_back();
    direct.emplace_back();
    const double bin_hz = kemar().rate_hz / kSize;
    for (std::size_t e = 0; e < kEars; ++e) {
      spectra[e] = spectrum_of(out[e].data(), out[e].size());
      measured[e] = spectrum_of(kemar().response(d, e), kemar().frames);
      ours.back()[e] = energy_of(spectra[e], kBin_hz);
      direct.back()[e] = energy_of(measured[e], bin_hz);
      for (std::size_t b = 0; b < kErbBandCount; ++b) {
        common[b] += direct.back()[e][b];
        our_common[b] += ours.back()[e][b];
      }
    }
  }
  std::array<double, kBandCount> worst_db{};
  for (std::size_t i = 0; i < ours.size(); ++i)
    for (std::size_t c = 1; c < kBandCount; ++c) {
      const auto between_ears_db = [&](const std::array<ErbBands, kEars>& ears,
                                       const ErbBands& all) {
        return octave_db(ears[0], all, c) - octave_db(ears[1], all, c);
      };
      worst_db[c] = std::max(worst_db[c], std::abs(between_ears_db(ours[i], our_common) -
                                                   between_ears_db(direct[i], common)));
    }
  for (std::size_t c = 1; c < kBandCount; ++c) EXPECT_LT(worst_db[c], 1.5) << c;
}

// Mixes voices of equal power at random delays into one noise (low bands would cancel at evenly
// spread delays), in narrow bands and in octaves. Spectrum and level difference between the ears
// are the same.
void compare_crowds(const Vec3f& middle, float spread) {
  constexpr std::uint32_t kVoices = 600;
  constexpr int kFrames = 32768;
  std::vector<Signal> sounds = {noisy_signal(5, 48000)};
  std::vector<Voice> voices;
  std::mt19937 random(6);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<double> anywhere(0, 48000);
  for (std::uint32_t v = 0; v < kVoices; ++v) {
    Vec3f scatter;
    for (int axis = 0; axis < 3; ++axis) scatter[axis] = normal(random);
    const Vec3f from = normalize(middle + spread * scatter);
    voices.push_back(testing::heard(kemar_head(), from, anywhere(random), 0.02f, true));
  }
  std::array<std::array<ErbBands, kEars>, 2> energy{};
  for (const int fine : {0, static_cast<int>(kVoices)}) {
    const auto out = mixed_crowd(kemar_head(), sounds, with_narrowband_voices(fine), kVoices,
                                 kFrames, [&](int k) {
                                   for (Voice& voice : voices) voice.starts = k == 0;
                                   return keyframe_of(voices);
                                 });
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t at = 0; at + kSize <= kFrames; at += kSize) {
        const ErbBands part = energy_of(spectrum_of(out[e].data() + at, kSize), kBin_hz);
        for (std::size_t b = 0; b < kErbBandCount; ++b) energy[fine > 0][e][b] += part[b];
      }
  }
  for (std::size_t e = 0; e < kEars; ++e)
    for (std::size_t b = 0; b < kErbBandCount; ++b)
      EXPECT_NEAR(10 * std::log10(energy[0][e][b] / energy[1][e][b]), 0, 1) << e << ' ' << b;
}

TEST(NarrowbandVoices, SoundLikeOctavesInACrowd) {
  compare_crowds({0, 0.8f, 0}, 1);           // all around
  compare_crowds({0.7f, 0.7f, 0.2f}, 0.3f);  // a stand of fans to the front left
}

TEST(NarrowbandVoices, AreTheLoudestOnes) {
  NarrowbandVoices fine(10, 3);
  const auto choose = [&](const std::vector<float>& powers) {
    fine.begin();
    for (std::uint32_t v = 0; v < powers.size(); ++v) fine.offer(v, powers[v]);
    fine.end();
    const std::array<float, kHrtfLanes> ones{};
    std::vector<std::uint32_t> chosen;
    for (std::uint32_t v = 0; v < powers.size(); ++v) {
      fine.set(v, fine.chosen(v) ? ones.data() : nullptr, false, kKeyframeFrames);
      if (fine.chosen(v)) chosen.push_back(v);
    }
    return chosen;
  };
  using Slots = std::vector<std::uint32_t>;
  const float none = std::nanf("");
  EXPECT_EQ(choose({1, 9, 2, 8, 3, 7, 4, 0, none, 5}), (Slots{1, 3, 5}));
  // Slightly louder voices do not replace them; voices of twice the level do.
  EXPECT_EQ(choose({8, 4, 8, 8, 8, 7, 8, 8, none, 20}), (Slots{3, 5, 9}));
  EXPECT_EQ(choose({0, 0, 0, 0, 0, 0, 0, 0, none, 0}), Slots{});
  EXPECT_EQ(choose({5, 6}), (Slots{0, 1}));
}

// With an HRTF that changes nothing, narrow bands and octaves sound alike, so the crossfade between
// the two must be inaudible as well.
TEST(NarrowbandVoices, CrossfadeToOctavesAndBackWithoutATrace) {
  const Hrtf head(no_head());
  const std::vector<Signal> sounds = {noisy_signal(3, 5000), noisy_signal(4, 7000)};
  constexpr int kFrames = 12 * kKeyframeFrames;
  const auto by_turns = [&](int k) {
    std::vector<Voice> voices;
    for (std::uint32_t v = 0; v < 2; ++v) {
      const float gain = static_cast<int>(v) == k % 2 ? 0.5f : 0.25f;
      voices.push_back(testing::heard(head, {0, 1, 0}, 300.25, gain, k == 0));
      voices[v].signal = v;
    }
    return keyframe_of(voices);
  };
  const auto changing = mixed_crowd(head, sounds, with_narrowband_voices(1), 2, kFrames, by_turns);
  const auto fine = mixed_crowd(head, sounds, with_narrowband_voices(2), 2, kFrames, by_turns);
  double error = 0, power = 0;
  for (std::size_t e = 0; e < kEars; ++e)
    for (std::size_t n = 0; n < fine[e].size(); ++n) {
      error += std::pow(changing[e][n] - fine[e][n], 2);
      power += std::pow(fine[e][n], 2);
    }
  EXPECT_LT(10 * std::log10(error / power), -50);
}

}  // namespace
}  // namespace clamor
