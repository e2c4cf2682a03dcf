#include "common/air.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace clamor {
namespace {

double db_per_km(double loss_per_m) { return loss_per_m * 1000 * 10 / std::log(10.0); }

struct Row {
  Air air;
  std::array<double, kBandCount> db_per_km;
};

// ISO 9613-1:1993, pure tones at the exact octave mid-frequencies 63 Hz to 8 kHz, in dB/km,
// computed by an independent implementation of its equations 3 to 5 and annex B. The standard's own
// table 1 has the same figures to the digits it prints.
const std::array<Row, 2> kIso9613 = {{
    {{20, 50, 101.325}, {0.123, 0.445, 1.318, 2.733, 4.665, 9.855, 29.42, 103.9}},
    {{10, 70, 101.325}, {0.122, 0.411, 1.043, 1.928, 3.658, 9.664, 32.77, 116.9}},
}};

TEST(Air, SwallowsAsMuchAsIso9613Says) {
  for (const Row& row : kIso9613) {
    const Bands loss = air_loss_per_m(row.air);
    for (std::size_t b = 0; b < kBandCount; ++b)
      EXPECT_NEAR(db_per_km(loss[b]) / row.db_per_km[b], 1, 0.01)
          << kBandCentres_hz[b] << " Hz at " << row.air.temperature_c << " C";
  }
}

TEST(Air, SwallowsATone) {
  // The same independent implementation at 1000 Hz, which is both nominal and exact.
  EXPECT_NEAR(db_per_km(air_loss_per_m(Air{}, 1000)), 4.665, 0.005);
}

TEST(Air, CarriesSoundFasterWhenWarm) {
  EXPECT_DOUBLE_EQ(speed_of_sound_mps(Air{}), 343.2);
  // Dry air at 0 C: 331.3 m/s in every textbook; ISO 9613-1's formula is within 0.1 m/s of it.
  EXPECT_NEAR(speed_of_sound_mps({.temperature_c = 0}), 331.3, 0.1);
}

}  // namespace
}  // namespace clamor
