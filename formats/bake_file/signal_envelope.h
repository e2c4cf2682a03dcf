// signal_envelope.h: energy envelope of a signal per octave band.
//
// The bake computes and stores it (bake_format.md), so that the sampler knows the level of a source
// without decoding its signal. The envelope is sampled in moments of at most 20 ms: a one-shot
// signal has a moment per 960 samples, the last padded with silence; a loop is divided into equal
// moments. Each is weighted by a Hann window that overlaps half of both neighbours. The windows sum
// to one, so energy is preserved, and they wrap around in a loop.
//
// Bands are separated by the mixer's crossovers (common/crossover.h) in zero-phase form, so that
// moments are not delayed. Filter ringing before the start or after the end of a one-shot signal
// counts for its first or last moment.
//
// Levels are stored in half decibels below the maximum of the band, down to 127 dB; lower levels
// are silent. The exact mean over all moments is stored separately as `mean_square`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/result.h"

namespace clamor {

struct Signal;

inline constexpr int kMomentFrames = 960;  // 20 ms: 50 a second

// Number of moments of a signal.
constexpr std::uint64_t moments_of(std::uint64_t frames) {
  return (frames + kMomentFrames - 1) / kMomentFrames;
}

class SignalEnvelope {
 public:
  SignalEnvelope() = default;

  // Takes about 0.7 s of one core per minute of sound; long signals are processed in parallel.
  explicit SignalEnvelope(const Signal& signal);

  // From stored steps, band by band, moment by moment: 255 is the maximum, each step less is half a
  // decibel, and 0 is silence. The Error is a predicate.
  static Result<SignalEnvelope> from_steps(const Bands& mean_square,
                                           std::vector<std::uint8_t> steps);

  std::size_t moments() const { return steps_.size() / kBandCount; }
  bool silent() const;

  // Mean square over all moments.
  const Bands& mean_square() const { return mean_square_; }

  // Mean square of one moment per band.
  Bands at(std::size_t moment) const;

  std::span<const std::uint8_t> steps() const { return steps_; }

 private:
  Bands mean_square_{}, loudest_{};
  std::vector<std::uint8_t> steps_;
};

}  // namespace clamor
