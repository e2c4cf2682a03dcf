#include "runtime/hrtf/hrtf_filter_bank.h"

#include <algorithm>
#include <cassert>

#include "runtime/voices/mix_fir.h"

namespace clamor {

const std::vector<float>& HrtfFilterBank::high_spectra() {
  static const std::vector<float> kSpectra = spectra_of(HrtfFilters::high(), kHighTaps);
  return kSpectra;
}

HrtfFilterBank::HrtfFilterBank()
    : high_(kEars * kHrtfHighBands * kHighWindow), low_(kEars * kHrtfLowRows * kLowRow) {
  // The audio thread must find the tables.
  HrtfFilters::prepare();
  high_spectra();
  for (int k = 0; k < kUpTaps; ++k)
    up_[static_cast<std::size_t>(k)] = static_cast<float>(OctaveFilterBank::up_tap(k));
}

void HrtfFilterBank::clear() noexcept REALTIME {
  std::fill(std::begin(buses_.high), std::end(buses_.high), 0.0f);
  std::fill(std::begin(buses_.low), std::end(buses_.low), 0.0f);
  std::fill(std::begin(octaves_.high), std::end(octaves_.high), 0.0f);
  std::fill(std::begin(octaves_.low), std::end(octaves_.low), 0.0f);
}

namespace {

struct BandRows {
  const HrtfLayer& layer;
  const float* buses;
  const float* octaves;
  std::size_t first_octave, end_octave;
  int stride, frames;
};

// Visits the frames of a band's bus plus, times its level, its share of the octave buses.
template <class LevelAt>
void sum_band(const BandRows& rows, std::size_t band, int ear, const LevelAt& level,
              float* out) noexcept REALTIME {
  const auto row = [&](std::size_t k) { return (kEars * static_cast<int>(k) + ear) * rows.stride; };
  std::copy_n(rows.buses + row(band), rows.frames, out);
  for (std::size_t octave = rows.first_octave; octave < rows.end_octave; ++octave) {
    const float share = HrtfFilters::octave_share(octave, rows.layer.first + band);
    if (share == 0) continue;
    const float* const add = rows.octaves + row(octave - rows.first_octave);
    for (int f = 0; f < rows.frames; ++f) out[f] += share * level(f) * add[f];
  }
}

}  // namespace

void HrtfFilterBank::LevelRamps::begin(const std::array<HrtfGains, kEars>& levels,
                                       int ramp_frames) noexcept REALTIME {
  for (std::size_t e = 0; e < kEars; ++e)
    for (std::size_t j = 0; j < kHrtfBands; ++j) {
      const float to = levels[e][j];
      const float from = ramp_frames == 0 ? to : at(static_cast<int>(e), j, 0);
      ramps[e][j] = {from, ramp_frames == 0 ? 0 : (to - from) / static_cast<float>(ramp_frames)};
    }
  frame = 0;
  frames = ramp_frames;
}

float HrtfFilterBank::LevelRamps::at(int ear, std::size_t band, int ahead) const noexcept REALTIME {
  const Ramp& ramp = ramps[static_cast<std::size_t>(ear)][band];
  return ramp.level + ramp.per_frame * static_cast<float>(std::min(frame + ahead, frames));
}

void HrtfFilterBank::LevelRamps::advance(int by_frames) noexcept REALTIME {
  frame = std::min(frame + by_frames, frames);
}

// Appends the call's frames from `first_frame` on to the current block.
void HrtfFilterBank::take_high(int first_frame, int frames) noexcept REALTIME {
  float row[kMaxFrames];
  const BandRows rows{kHrtfHighLayer,
                      buses_.high + first_frame,
                      octaves_.high + first_frame,
                      kLowBands,
                      kBandCount,
                      kMaxFrames,
                      frames};
  for (std::size_t b = 0; b < kHrtfHighBands; ++b)
    for (int ear = 0; ear < kEars; ++ear) {
      const auto level = [&](int f) { return levels_.at(ear, kHrtfLowBands + b, first_frame + f); };
      sum_band(rows, b, ear, level, row);
      const std::size_t group = b / kSpectrumLanes;
      const std::size_t first = (group * kEars + static_cast<std::size_t>(ear)) * kHighWindow +
                                static_cast<std::size_t>(kHighHistory + high_frames_);
      float* const out = high_.data() + first * kSpectrumLanes + b % kSpectrumLanes;
      for (int f = 0; f < frames; ++f) out[f * kSpectrumLanes] = row[f];
    }
  high_frames_ += frames;
}

void HrtfFilterBank::filter_high_block() noexcept REALTIME {
  filter_pairs({high_spectra().data(), kHighGroups, high_.data(), kHighWindow, &work_, &sum_});
  for (int ear = 0; ear < kEars; ++ear) {
    const float* lanes = (ear == 0 ? sum_.left : sum_.right) + kHighReach * kSpectrumLanes;
    for (int f = 0; f < kBlockFrames; ++f, lanes += kSpectrumLanes) {
      float sum = 0;
      for (int lane = 0; lane < kSpectrumLanes; ++lane) sum += lanes[lane];
      high_sum_[ear][high_due_ + f] = sum;
    }
  }
  high_due_ += kBlockFrames;
  high_frames_ = 0;
  for (int part = 0; part < kHighGroups * kEars; ++part) {
    float* const window = high_.data() + std::size_t{kHighWindow} * kSpectrumLanes * part;
    std::copy_n(window + kBlockFrames * kSpectrumLanes, kHighHistory * kSpectrumLanes, window);
  }
}

void HrtfFilterBank::process(int frames, float* interleaved) noexcept REALTIME {
  assert(frames % kStepFrames == 0 && frames <= kMaxFrames);
  const int low_frames = frames / kLowRate;
  for (int first = 0; first < frames;) {
    const int count = std::min(frames - first, kBlockFrames - high_frames_);
    take_high(first, count);
    first += count;
    if (high_frames_ == kBlockFrames) filter_high_block();
  }
  const BandRows low_rows{kHrtfLowLayer,         buses_.low, octaves_.low, 0, kLowBands,
                          kMaxFrames / kLowRate, low_frames};
  for (int ear = 0; ear < kEars; ++ear) {
    float* const rows = low_.data() + ear * kHrtfLowRows * kLowRow;
    for (std::size_t b = 0; b < kHrtfLowBands; ++b) {
      const auto level = [&](int f) { return levels_.at(ear, b, kLowRate * f); };
      sum_band(low_rows, b, ear, level, rows + b * kLowRow + kLowHistory);
    }
    for (std::size_t row = kHrtfLowBands; row < kHrtfLowRows; ++row)
      std::copy_n(buses_.low + (kEars * row + ear) * (kMaxFrames / kLowRate), low_frames,
                  rows + row * kLowRow + kLowHistory);
    float* const low = low_sum_[ear];
    sum_filtered({HrtfFilters::low().data(), rows, kLowRow, kHrtfLowRows, kLowTaps, low_frames,
                  low + kUpHistory});
    float* const high = high_sum_[ear];
    for (int f = 0; f < frames; ++f) {
      float sum = high[f];
      for (int k = f % kLowRate, at = kUpHistory + f / kLowRate; k < kUpTaps; k += kLowRate, --at)
        sum += up_[static_cast<std::size_t>(k)] * low[at];
      interleaved[f * kEars + ear] = sum;
    }
    std::copy(high + frames, high + high_due_, high);
    std::copy_n(low + low_frames, kUpHistory, low);
    for (std::size_t b = 0; b < kHrtfLowRows; ++b)
      std::copy_n(rows + b * kLowRow + low_frames, kLowHistory, rows + b * kLowRow);
  }
  high_due_ -= frames;
  levels_.advance(frames);
}

}  // namespace clamor
