// late_density.h: where the late taps of a signal are too few to sound like a room, and into how
// many pieces each is to be spread.
//
// Late in a decay, a few strong sources stand for a great many, and what should be dense is grainy:
// in the violin room with 200 000 sources, echo density is 0.46 to 0.66 at 600 ms above 1 kHz,
// where a room has 1. A tap that carries more than a share 1 / kPieces_per_s of the power per
// second around it, in any band from 500 Hz on, becomes pieces that carry that share each. The
// first keeps the tap's delay, and the others have random signs within kWidth_frames around it
// (velvet noise), so that the power in each band and its decay stay as they are.
//
// Echoes that repeat or stand alone are no grain: their taps come in clusters. The taps that would
// be spread are counted by the millisecond, and where the variance of the counts exceeds their mean
// by far, none is spread. Independent arrivals have a ratio of 1.
//
// H. Jarvelainen, M. Karjalainen. Reverberation Modeling Using Velvet Noise. AES 30th Conference,
// 2007. J. Abel, P. Huang. A Simple, Robust Measure of Reverberation Echo Density. AES 121st
// Convention, 2006.
//
// A pass over the taps uses what the pass before it has counted.   Threads: the sampler's.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/bands.h"
#include "common/sample_rate.h"

namespace clamor {

class LateDensity {
 public:
  static constexpr double kPieces_per_s = 16'000;
  static constexpr double kWidth_frames = 0.036 * kSampleRate_hz;
  // Taps are spread from the first delay on, and wholly from the second.
  static constexpr double kFrom_frames = 0.1 * kSampleRate_hz, kWhole_frames = 0.2 * kSampleRate_hz;

  // Begins a pass.
  void begin();
  // Passes that must follow before the pieces are right.
  int lacks_passes() const { return 3 - passes_; }

  // The number of pieces of a tap with these powers, 1 or more; the last one may be a part.
  double pieces(double delay_frames, const Bands& power);

  // Piece `k` of a tap.
  struct Piece {
    double shift_frames;
    float amplitude;
  };
  static Piece piece(std::uint32_t tap, std::uint32_t k, double pieces);

 private:
  static constexpr std::size_t kFirstBand = 3, kBands = kBandCount - kFirstBand;
  static constexpr int kBin_frames = kSampleRate_hz / 1000;
  static constexpr std::size_t kSmooth_bins = 30, kCount_bins = 24;  // to either side
  static constexpr double kMostClustered = 2;  // variance of counts over their mean
  static constexpr float kCounts = 0.25f;      // pieces from which a tap counts

  struct Bin {
    std::array<float, kBands> power{};
    std::uint64_t arrivals = 0;  // a bit for each 64th of the bin
  };
  struct Rule {
    std::array<float, kBands> pieces_per_power{};
    bool spreads = false;
  };

  int passes_ = 0;
  std::vector<Bin> bins_;
  std::vector<Rule> rules_;
};

}  // namespace clamor
