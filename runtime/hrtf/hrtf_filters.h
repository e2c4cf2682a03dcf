// hrtf_filters.h: the filters of the HRTF filter bank (hrtf_filter_bank.h) and their responses.
//
// Tables are computed at the first use, and all of them by prepare().
//
// Threads: any; the audio thread after prepare().
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/bands.h"
#include "common/sample_rate.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

// Centre frequencies of the bands and of the quadratures, ascending.
extern const std::array<double, kHrtfBands> kHrtfNodes_hz;
extern const std::array<double, kHrtfQuadratures> kQuadratureNodes_hz;

using HrtfGains = std::array<float, kHrtfBands>;  // amplitude
using QuadratureGains = std::array<float, kHrtfQuadratures>;

struct HrtfLayer {
  std::size_t first, bands;
  int reach;  // taps to either side
  double rate_hz;

  constexpr int taps() const { return 2 * reach + 1; }
};
inline constexpr HrtfLayer kHrtfLowLayer{0, kHrtfLowBands, 186, 1.0 * kSampleRate_hz / kLowRate};
inline constexpr HrtfLayer kHrtfHighLayer{kHrtfLowBands, kHrtfHighBands, 192, kSampleRate_hz};

class HrtfFilters {
 public:
  // Computes all tables, so that the audio thread finds them.
  static void prepare();

  static const std::vector<float>& high();  // [band][tap]
  static const std::vector<float>& low();   // [band, then quadrature][tap]

  // |B_band| at a frequency including the layer split, and the same of a quadrature.
  static double magnitude(std::size_t band, double frequency_hz);
  static double quadrature_magnitude(std::size_t quadrature, double frequency_hz);

  // A voice's octave gains at the nodes: linear between the octave centres, exact at them.
  static HrtfGains levels_of(const Bands& gains) noexcept REALTIME;

  // Band gains interpolated to the quadrature nodes.
  static QuadratureGains at_quadratures(const HrtfGains& levels) noexcept REALTIME;

  // bus_gains() is the matrix that makes tones at octave centres come out with the wanted gains:
  // row b times the gains is the gain of bus b. octave_share() is the gain of such a bus in a band,
  // 0 for a band of the other layer.
  using OctaveMatrix = std::array<std::array<double, kBandCount>, kBandCount>;
  static const OctaveMatrix& bus_gains();
  static float octave_share(std::size_t octave, std::size_t band) noexcept REALTIME;
};

}  // namespace clamor
