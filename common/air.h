// air.h: speed and attenuation of sound in air.
#pragma once

#include "common/bands.h"

namespace clamor {

struct Air {
  double temperature_c = 20;
  double humidity_percent = 50;
  double pressure_kpa = 101.325;

  bool operator==(const Air&) const = default;
};

// c = 343.2 sqrt(T / 293.15 K), as in ISO 9613-1, annex A.
double speed_of_sound_mps(const Air& air);

// Attenuation coefficient of a pure tone in nepers of energy per metre: intensity falls as
// exp(-loss r).
//
// ISO 9613-1:1993, equations 3 to 5 and annex B. Accurate to 10 % from -20 to 50 C and below
// 200 kPa, as the standard states; the formula itself is exact here.
double air_loss_per_m(const Air& air, double frequency_hz);

// Attenuation at the exact mid-band frequencies, 1000 x 10^0.3k Hz.
Bands air_loss_per_m(const Air& air);

}  // namespace clamor
