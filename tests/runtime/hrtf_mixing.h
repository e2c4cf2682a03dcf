// hrtf_mixing.h: HRTFs for tests of the mixer, and measures of its output.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "common/fourier.h"
#include "formats/audio/sofa_file.h"
#include "runtime/hrtf/erb_bands.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/mixing/mixer.h"
#include "tests/runtime/mixer_voices.h"
#include "tests/sanitized.h"

namespace clamor::testing {

inline constexpr std::size_t kSize = 8192;
inline constexpr double kBin_hz = 1.0 * kSampleRate_hz / kSize;

// The measurement to which the default head is fitted, as libmysofa brings it.
inline constexpr const char* kKemar = "/usr/share/libmysofa/MIT_KEMAR_normal_pinna.sofa";

inline const HrirSet& kemar() {
  static const auto kResponses = read_sofa(kKemar);
  return *kResponses;
}
inline const Hrtf& kemar_head() {
  static const auto kHead = *Hrtf::read("");
  return *kHead;
}

// HRTF that changes nothing, from any direction.
inline HrirSet no_head() {
  HrirSet responses{1.0 * kSampleRate_hz, 64, {}, {}};
  for (std::size_t i = 0; i < 100; ++i) {
    const double z = (2.0 * static_cast<double>(i) + 1) / 100 - 1,
                 turn = 2.4 * static_cast<double>(i);
    const double r = std::sqrt(1 - z * z);
    responses.directions.push_back(Vec3f(Vec3(r * std::cos(turn), r * std::sin(turn), z)));
    for (int ear = 0; ear < 2; ++ear) {
      responses.samples.push_back(1);
      responses.samples.insert(responses.samples.end(), 63, 0.0f);
    }
  }
  return responses;
}

inline const MixMode kBinaural = [] {
  MixMode mode;
  mode.head = true;
  return mode;
}();

inline Voice heard(const Hrtf& head, const Vec3f& from, double delay_frames, float gain,
                   bool starts) {
  Voice voice;
  voice.starts = starts;
  voice.from = from;
  for (int e = 0; e < kEars; ++e) {
    voice.delay_frames[e] = delay_frames + head.delay_frames(from, e);
    voice.gain[e] = same_in_all_bands(gain);
  }
  voice.start_delay_frames = voice.delay_frames;
  return voice;
}

// Both ears, `frames` frames; next(k) returns the voice of keyframe k.
template <class Next>
std::array<std::vector<float>, kEars> mixed(const Hrtf& head, const Signal& sound, int frames,
                                            Next next, const MixMode& mode = kBinaural) {
  const auto signals = prepare_signals(std::vector<Signal>{sound}, mode);
  Mixer mixer(signals, 4, mode, nullptr, &head);
  const auto keyframe = [&](int k) {
    Keyframe result;
    result.voices = {next(k)};
    return result;
  };
  return heard_of(mixer, frames, keyframe);
}

inline Signal click() {
  Signal sound;
  sound.samples = {1};
  sound.loop = false;
  return sound;
}

// Both ears for a click from a measured direction, mixed at its first use.
inline const std::array<std::vector<float>, kEars>& mixed_click(std::size_t direction,
                                                                const MixMode& mode = kBinaural) {
  static std::map<std::pair<int, std::size_t>, std::array<std::vector<float>, kEars>> clicks;
  auto& ears = clicks[{mode.narrowband_voices, direction}];
  if (ears[0].empty())
    ears = mixed(
        kemar_head(), click(), 4096,
        [&](int k) { return heard(kemar_head(), kemar().directions[direction], 2000, 1, k == 0); },
        mode);
  return ears;
}

using Spectrum = std::vector<std::complex<double>>;

inline Spectrum spectrum_of(const float* samples, std::size_t frames) {
  static const Fourier kFourier(kSize);
  Spectrum spectrum(kSize);
  std::copy_n(samples, frames, spectrum.begin());
  kFourier.forward(spectrum);
  return spectrum;
}

// Mean square per ERB band; each bin is shared between bands by width.
inline ErbBands energy_of(const Spectrum& spectrum, double bin_hz) {
  ErbBands energy{};
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    const double low = erb_frequency_hz(static_cast<double>(b) + 1) / bin_hz;
    const double high = erb_frequency_hz(static_cast<double>(b) + 2) / bin_hz;
    for (auto k = static_cast<std::size_t>(low); static_cast<double>(k) < high + 1; ++k) {
      const double at = static_cast<double>(k);
      const double share = std::min(high, at + 0.5) - std::max(low, at - 0.5);
      if (share > 0) energy[b] += share * std::norm(spectrum[k]) / (high - low);
    }
  }
  return energy;
}

// Indices of 200 measured directions, evenly spread over the set.
inline std::vector<std::size_t> two_hundred() {
  std::vector<std::size_t> chosen;
  const std::size_t step = kSanitized ? 5 : 1;  // fewer, because they are slow
  for (std::size_t i = 0; i < 200; i += step) chosen.push_back(i * kemar().directions.size() / 200);
  return chosen;
}

}  // namespace clamor::testing
