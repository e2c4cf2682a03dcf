#include "runtime/hrtf/erb_bands.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/tools/analysis/test_sounds.h"
#include "tools/analysis/erb_spectrum.h"
#include "tools/analysis/sound_spectrum.h"

namespace clamor {
namespace {

TEST(ErbBands, AreOneErbWideAndAdjacent) {
  // An example of Glasberg and Moore: 132.6 Hz at 1 kHz. The number grows by 1 per ERB.
  EXPECT_NEAR(erb_width_hz(1000), 132.6, 0.1);
  for (double hz = 30; hz < 20000; hz *= 1.3) {
    EXPECT_NEAR(erb_frequency_hz(erb_number(hz)), hz, 1e-9 * hz);
    EXPECT_NEAR(erb_number(hz + erb_width_hz(hz) / 2) - erb_number(hz - erb_width_hz(hz) / 2), 1,
                0.03);
  }
}

}  // namespace
}  // namespace clamor
