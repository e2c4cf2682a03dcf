// absorption_fit.h: absorptions by which a level decays as it was measured.
//
// Photons are traced once with their paths. The energy that a path brings to a receiver is a
// product over its reflections, so other absorptions are weights of the same paths:
//
//     E = E_traced * product over materials m of ((1 - a_m) / (1 - traced a_m)) ^ n_m
//
// with n_m reflections off material m, and the derivative of a decay time follows from the sums of
// n_m E. In each octave one time is known and each material's absorption is not. Of all that give
// the time, the fit takes the most likely: that with the least
//
//     sum over m of S_m (a_m - known a_m)^2 / deviation_m^2,
//
// S_m the area. Areas make the result independent of how a surface is divided into materials.
// Gauss-Newton steps find it: to first order, 1 / T is linear in absorptions, and each step is a
// search for one multiplier along which absorptions end at their bounds. Surfaces that absorb all,
// thin ones, which let sound through, and different ones of one name stay as they are. (A.
// Tarantola. Inverse Problem Theory. SIAM 2005, ch. 3.)
//
// Paths end early where the traced absorptions leave them quiet. Where fewer than kMinEffective
// of them carry the end of the range, photons are traced again with the absorptions found so far.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/bands.h"
#include "common/result.h"

namespace clamor {

struct BakeOptions;
struct Level;

// Reverberation times that were measured.
struct MeasuredDecay {
  double to_db = -35;  // of T30, or -25 of T20; both begin at -5 dB
  std::array<std::optional<double>, kBandCount> times_s{};

  const char* name() const { return to_db < -30 ? "T30" : "T20"; }

  // Reads figures as in ROOM.json (formats/room.schema.json), of which t30_s or t20_s counts.
  static Result<MeasuredDecay> read(const std::string& path);
};

// What is known of an absorption: that of a table, from which a real surface deviates by
// kAbsorptionError and a share of it. It is bounded by three such deviations, and by the least and
// the most that can be measured. These are assumptions: the tables that the presets are from give
// no errors.
inline constexpr double kAbsorptionError = 0.03, kRelativeAbsorptionError = 0.2;
inline constexpr double kAbsorptionDeviations = 3;
inline constexpr double kLeastAbsorption = 0.01, kMostAbsorption = 0.99;
struct AbsorptionRange {
  double known = 0, deviation = 0, least = 0, most = 0;
  static AbsorptionRange of(double absorption);
};

struct AbsorptionFit {
  struct Octave {
    double measured_s = 0, before_s = 0, after_s = 0;
    double error_s = 0;  // standard error of after_s
  };
  struct Surface {  // all materials of one name
    std::string name;
    double area_m2 = 0;
    Bands before{}, after{};
    std::array<double, kBandCount> slope_s{};  // d time / d absorption, afterwards; 0: not fitted
  };
  std::array<std::optional<Octave>, kBandCount> octaves{};
  std::vector<Surface> surfaces;  // those that are fitted, largest area first
  int traces = 0;
};

// Traces the emitters of a prepared level. Fails where no absorptions within their bounds give the
// measured times.
Result<AbsorptionFit> fit_absorption(const Level& level, const BakeOptions& options,
                                     const MeasuredDecay& measured);

// Writes a sidecar with the absorptions: that at `earlier`, if there is one, with other materials.
Result<void> write_fitted_sidecar(const std::string& path, const std::string& earlier,
                                  const Level& level, const AbsorptionFit& fit);

}  // namespace clamor
