#include "formats/level/signal_table.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace clamor::testing {
namespace {

TEST(BuiltInNoise, IsPinkWithAnRmsOfMinus20Decibels_NoAsan) {
  const auto noise = built_in_signal("noise");
  ASSERT_EQ(noise.size(), 192000u);
  double power = 0;
  for (const float sample : noise) {
    power += double{sample} * sample / 192000;
    ASSERT_LT(std::fabs(sample), 0.99f);
  }
  EXPECT_NEAR(10 * std::log10(power), -20, 0.001);
  // Octave powers from every 8th Fourier coefficient, which are equal in pink noise. With at least
  // 600 coefficients per octave, two standard deviations are 0.35 dB.
  std::vector<double> octave_db;
  for (double low_hz = 300; low_hz < 5000; low_hz *= 2) {
    double sum = 0;
    int count = 0;
    const int step = static_cast<int>(low_hz / 300) * 8;
    for (int k = static_cast<int>(low_hz * 4); k < static_cast<int>(low_hz * 8);
         k += step, ++count) {
      double re = 0, im = 0, c = 1, s = 0;
      const double dc = std::cos(2 * M_PI * k / 192000), ds = std::sin(2 * M_PI * k / 192000);
      for (const float sample : noise) {
        re += sample * c;
        im += sample * s;
        const double next = c * dc - s * ds;
        s = s * dc + c * ds;
        c = next;
      }
      sum += re * re + im * im;
    }
    octave_db.push_back(10 * std::log10(sum / count * low_hz));
  }
  // 150 coefficients per octave have 10 log10(1 + 1 / sqrt(150)) = 0.34 dB, so 1.2 dB is 3.5 sigma.
  for (const double db : octave_db) EXPECT_NEAR(db, octave_db[0], 1.2);
}

}  // namespace
}  // namespace clamor::testing
