#include "tools/analysis/programme_loudness.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <new>

#include <ebur128.h>

#include "common/sample_rate.h"

namespace clamor {

namespace {

constexpr std::size_t kHopFrames = kSampleRate_hz / 10;

struct Destroy {
  void operator()(ebur128_state* state) const { ebur128_destroy(&state); }
};

}  // namespace

ProgrammeLoudness programme_loudness(const Sound& sound) {
  const std::size_t channels = sound.channels.size();
  assert(channels == 1 || channels == 2);
  const std::unique_ptr<ebur128_state, Destroy> state(
      ebur128_init(static_cast<unsigned>(channels), kSampleRate_hz, EBUR128_MODE_I));
  if (state == nullptr) throw std::bad_alloc();

  ProgrammeLoudness loudness;
  std::vector<float> block(kHopFrames * channels);
  const std::size_t frames = sound.frames();
  for (std::size_t done = 0; done + kHopFrames <= frames; done += kHopFrames) {
    for (std::size_t i = 0; i < kHopFrames; ++i)
      for (std::size_t c = 0; c < channels; ++c)
        block[i * channels + c] = sound.channels[c][done + i];
    ebur128_add_frames_float(state.get(), block.data(), kHopFrames);
    if (done + kHopFrames < 4 * kHopFrames) continue;
    double momentary_lufs = -std::numeric_limits<double>::infinity();
    ebur128_loudness_momentary(state.get(), &momentary_lufs);
    loudness.momentary_lufs.push_back(momentary_lufs);
  }
  double integrated_lufs = kSilence_lufs;
  if (ebur128_loudness_global(state.get(), &integrated_lufs) == EBUR128_SUCCESS)
    loudness.integrated_lufs = std::max(kSilence_lufs, integrated_lufs);
  return loudness;
}

}  // namespace clamor
