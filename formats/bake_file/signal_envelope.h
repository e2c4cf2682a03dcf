// signal_envelope.h: how loud a signal is from moment to moment, in each octave band.
//
// Made by the bake and kept in its file (bake_format.md), so that the sampler knows what a source
// plays now without listening to it. A moment is 20 ms: a signal that plays once has one for each
// 960 samples, the last filled up with silence; a loop is cut into as many equal ones as make them
// no longer than that. Each is weighed by a Hann window over itself and half of both neighbours;
// the windows add up to one everywhere, so no energy is lost or counted twice, and a loop's last
// moment runs into its first.
//
// Bands are parted by the mixer's own crossovers (common/crossover.h), without phase: moments are
// where they are heard. What filtering spreads before the start or past the end of a signal that
// plays once counts for its first and last moment.
//
// A moment's level is kept in half decibels below the band's loudest, 127 dB down; beyond that it
// is silent. The mean over all moments is `mean_square`, exactly: it is kept beside them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/result.h"
#include "formats/level/level.h"

namespace clamor {

inline constexpr int kMomentFrames = 960;  // 20 ms: 50 a second

// How many moments a signal has.
constexpr std::uint64_t moments_of(std::uint64_t frames) {
  return (frames + kMomentFrames - 1) / kMomentFrames;
}

class SignalEnvelope {
 public:
  SignalEnvelope() = default;

  // Costs about 0.7 s of one core per minute of sound; long ones are shared out.
  explicit SignalEnvelope(const Signal& signal);

  // From what a file holds: `steps` band after band, moment after moment; 255 is the loudest, each
  // step less is half a decibel, 0 is silent. An Error is half a sentence.
  static Result<SignalEnvelope> from_steps(const Bands& mean_square,
                                           std::vector<std::uint8_t> steps);

  std::size_t moments() const { return steps_.size() / kBandCount; }
  bool silent() const;

  // Over all moments; of a loop, the mean square of what each band passes.
  const Bands& mean_square() const { return mean_square_; }

  // The mean square of one moment, per band.
  Bands at(std::size_t moment) const;

  std::span<const std::uint8_t> steps() const { return steps_; }

 private:
  Bands mean_square_{}, loudest_{};
  std::vector<std::uint8_t> steps_;
};

}  // namespace clamor
