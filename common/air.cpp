#include "common/air.h"

#include <cmath>
#include <numbers>

#include "common/maths.h"

namespace clamor {

namespace {

constexpr double kReference_k = 293.15;
constexpr double kTriplePoint_k = 273.16;
constexpr double kReference_kpa = 101.325;

double kelvin(const Air& air) { return air.temperature_c + 273.15; }

}  // namespace

double speed_of_sound_mps(const Air& air) { return 343.2 * std::sqrt(kelvin(air) / kReference_k); }

double air_loss_per_m(const Air& air, double frequency_hz) {
  const double f2 = frequency_hz * frequency_hz;
  const double t = kelvin(air) / kReference_k;
  const double p = air.pressure_kpa / kReference_kpa;

  // Molar concentration of water vapour in per cent (annex B).
  const double saturation =
      power(10.0, -6.8346 * power(kTriplePoint_k / kelvin(air), 1.261) + 4.6151);
  const double h = air.humidity_percent * saturation / p;

  // Relaxation frequencies of oxygen and nitrogen (equations 3 and 4).
  const double oxygen_hz = p * (24 + 4.04e4 * h * (0.02 + h) / (0.391 + h));
  const double nitrogen_hz =
      p / std::sqrt(t) * (9 + 280 * h * exp_of(-4.170 * (power(t, -1.0 / 3) - 1)));

  // Equation 5 gives decibels per metre; converted to nepers of energy.
  const double db_per_m =
      8.686 * f2 *
      (1.84e-11 / p * std::sqrt(t) +
       power(t, -2.5) *
           (0.01275 * exp_of(-2239.1 / kelvin(air)) / (oxygen_hz + f2 / oxygen_hz) +
            0.1068 * exp_of(-3352.0 / kelvin(air)) / (nitrogen_hz + f2 / nitrogen_hz)));
  return db_per_m * std::numbers::ln10 / 10;
}

Bands air_loss_per_m(const Air& air) {
  Bands loss{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double mid_hz = 1000 * power(10.0, 0.3 * (static_cast<double>(b) - 4));
    loss[b] = static_cast<float>(air_loss_per_m(air, mid_hz));
  }
  return loss;
}

}  // namespace clamor
