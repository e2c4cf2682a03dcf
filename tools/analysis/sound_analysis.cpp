#include "tools/analysis/sound_analysis.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "common/sample_rate.h"
#include "runtime/response/octave_filter.h"
#include "tools/analysis/echo_density.h"
#include "tools/analysis/erb_spectrum.h"
#include "tools/analysis/sound_spectrum.h"

namespace clamor {

namespace {

constexpr std::size_t kFirstEchoBand = 3;  // 500 Hz

double peak_of(std::span<const float> samples) {
  double peak = 0;
  for (const float x : samples) peak = std::max(peak, static_cast<double>(std::abs(x)));
  return peak;
}

void measure_decay(std::span<const float> samples, SoundAnalysis::Ear& ear) {
  ear.room = room_parameters(samples, same_in_all_bands(1));
  const std::size_t direct = direct_sound(samples);
  if (direct == samples.size()) return;
  const std::vector<double> signal(samples.begin(), samples.end());
  const double length_s = static_cast<double>(signal.size() - direct) / kSampleRate_hz;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const std::vector<double> octave = octave_of(signal, b);
    const DecayCurve curve = octave_decay(octave, direct, signal.size());
    // Leave out the end of the file, which is not a decay.
    for (double t_s = 0; t_s < 0.9 * length_s; t_s += kEchoDensityHop_s)
      ear.decay_db[b].push_back(curve.level_db(t_s));
    if (b >= kFirstEchoBand)
      ear.echo_density[b] =
          echo_density(std::span(octave).first(kOctaveRing + signal.size()), kOctaveRing + direct);
  }
}

// The earliest direct sound of the ears; the end of the sound if it is silent.
std::size_t first_direct_sound(const Sound& sound) {
  double peak = 0;
  for (const auto& channel : sound.channels) peak = std::max(peak, peak_of(channel));
  std::size_t direct = sound.frames();
  for (const auto& channel : sound.channels)
    if (peak > 0 && peak_of(channel) >= peak / 10) direct = std::min(direct, direct_sound(channel));
  return direct;
}

// The first 80 ms from the direct sound on.
Sound early_part(const Sound& sound) {
  constexpr std::size_t kEarly = kSampleRate_hz * 8 / 100;
  const std::size_t direct = first_direct_sound(sound);
  Sound early{{}, sound.file_rate_hz, {}};
  for (const auto& channel : sound.channels)
    early.channels.emplace_back(
        channel.begin() + static_cast<std::ptrdiff_t>(direct),
        channel.begin() + static_cast<std::ptrdiff_t>(std::min(channel.size(), direct + kEarly)));
  return early;
}

}  // namespace

bool looks_like_impulse_response(const Sound& sound) {
  double energy = 0, moment = 0, end = 0;
  const std::size_t direct = first_direct_sound(sound);
  for (const auto& channel : sound.channels)
    for (std::size_t i = direct; i < channel.size(); ++i) {
      const double x2 = static_cast<double>(channel[i]) * channel[i];
      energy += x2;
      moment += x2 * static_cast<double>(i - direct);
      if (i >= channel.size() - channel.size() / 10) end += x2;
    }
  return moment < energy * static_cast<double>(sound.frames() - direct) / 8 && end < 1e-3 * energy;
}

SoundAnalysis analyse(Sound sound, SoundKind kind) {
  assert(sound.channels.size() == 1 || sound.channels.size() == 2);
  SoundAnalysis analysis{.kind = kind, .sound = std::move(sound)};
  const Sound& heard = analysis.sound;
  const SoundSpectrum spectrum = sound_spectrum(heard);
  for (const auto& energy : spectrum.energy) {
    const ErbBands bands = erb_spectrum(energy);
    for (std::size_t b = 0; b < kErbBandCount; ++b) analysis.spectrum[b] += bands[b];
  }
  analysis.binaural = binaural_cues(spectrum);
  if (kind == SoundKind::kImpulseResponse)
    analysis.early_binaural = binaural_cues(sound_spectrum(early_part(heard)));
  if (kind == SoundKind::kProgramme) analysis.loudness = programme_loudness(heard);
  for (const auto& channel : heard.channels) {
    SoundAnalysis::Ear& ear = analysis.ears.emplace_back();
    if (kind == SoundKind::kProgramme) {
      ear.clicks = find_clicks(channel, 1e-4 * peak_of(channel));
      ear.texture = texture_statistics(channel);
    } else {
      measure_decay(channel, ear);
    }
  }
  return analysis;
}

}  // namespace clamor
