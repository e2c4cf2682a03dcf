// hrtf_magnitude_fit_test.cpp: level and time at the ears while the head turns about each axis,
// past sources on the great circle of that rotation and on smaller circles, in every ERB band and
// over all bands.
//
// The slope of a level is bounded by that of the measured HRTF, which has narrow notches. A
// listener who turns must hear no jumps.
#include "runtime/hrtf/hrtf_magnitude_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

using namespace testing;

// z; the measured directions of KEMAR end 40 degrees below
constexpr double kLowestMeasured = -0.643;
constexpr double kSteps_per_degree = kSanitized ? 1 : 4;

enum class Axis { kYaw, kPitch, kRoll };
constexpr Axis kAxes[] = {Axis::kYaw, Axis::kPitch, Axis::kRoll};
constexpr double kOff_axis[] = {-0.7, -0.5, -0.3, 0, 0.3, 0.5, 0.7, 0.9};

// Direction of a source on a circle about the axis, after a rotation by `degrees`.
Vec3f on_circle(Axis axis, double off_axis, double degrees) {
  const double turn = degrees * std::numbers::pi / 180, r = std::sqrt(1 - off_axis * off_axis);
  const double c = r * std::cos(turn), s = r * std::sin(turn);
  if (axis == Axis::kYaw) return Vec3f(Vec3(c, s, off_axis));
  return Vec3f(axis == Axis::kPitch ? Vec3(c, off_axis, s) : Vec3(off_axis, c, s));
}

struct AtEars {
  std::array<ErbBands, kEars> bands_db{};
  std::array<double, kEars> level_db{};
  double high_us = 0, low_us = 0;  // between the ears
};

AtEars at_ears(const Vec3f& from) {
  static const HrtfGains kFlat = HrtfFilters::levels_of(same_in_all_bands(1));
  static const HrtfMagnitudeFit kFit;
  AtEars ears;
  const auto place = kemar_head().place(from);
  const auto levels = kemar_head().gains(place);
  for (std::size_t e = 0; e < kEars; ++e) {
    std::array<double, kHrtfBands> heard_levels{};
    for (std::size_t j = 0; j < kHrtfBands; ++j) heard_levels[j] = levels[e][j] * kFlat[j];
    double sum = 0;
    const ErbBands energy = kFit.energy_of(heard_levels);
    for (std::size_t b = 0; b < kErbBandCount; ++b) {
      sum += energy[b];
      ears.bands_db[e][b] = 10 * std::log10(energy[b]);
    }
    ears.level_db[e] = 10 * std::log10(sum);
  }
  constexpr double kFrame_us = 1e6 / kSampleRate_hz;
  ears.high_us = kFrame_us * 2 * kemar_head().delay_frames(from, 1);
  ears.low_us = ears.high_us + kFrame_us * kemar_head().low_itd_frames(place);
  return ears;
}

// The steepest slopes per degree, and the share of the circle on which a band exceeds 1 dB.
struct Slopes {
  double level_db = 0, high_us = 0, low_us = 0;
  ErbBands bands_db{}, share{};

  double steepest_band_db() const { return *std::ranges::max_element(bands_db); }
};

// Slopes on all circles about an axis, without sources below `lowest`.
Slopes slopes_of(Axis axis, double lowest) {
  Slopes slopes;
  int steps = 0;
  for (const double off_axis : kOff_axis) {
    std::optional<AtEars> last;
    for (int step = 0; step <= 360 * kSteps_per_degree; ++step) {
      const Vec3f from = on_circle(axis, off_axis, step / kSteps_per_degree);
      if (static_cast<double>(from.z) < lowest) {
        last.reset();
        continue;
      }
      const AtEars now = at_ears(from);
      const auto steeper = [](double& most, double change) {
        const double slope = kSteps_per_degree * std::abs(change);
        most = std::max(most, slope);
        return slope;
      };
      if (last) {
        ++steps;
        steeper(slopes.high_us, now.high_us - last->high_us);
        steeper(slopes.low_us, now.low_us - last->low_us);
        for (std::size_t e = 0; e < kEars; ++e) {
          steeper(slopes.level_db, now.level_db[e] - last->level_db[e]);
          for (std::size_t b = 0; b < kErbBandCount; ++b)
            slopes.share[b] +=
                steeper(slopes.bands_db[b], now.bands_db[e][b] - last->bands_db[e][b]) > 1;
        }
      }
      last = now;
    }
  }
  for (double& share : slopes.share) share /= kEars * steps;
  return slopes;
}

TEST(HrtfRotation, ChangesLevelsByAtMostADecibelPerDegreeExceptAtNotches) {
  for (const Axis axis : kAxes) {
    const Slopes all_round = slopes_of(axis, -1);
    const Slopes slopes = slopes_of(axis, kLowestMeasured);
    EXPECT_LT(all_round.level_db, 1);
    EXPECT_LT(slopes.level_db, 0.25);
    EXPECT_LT(slopes.high_us, 30);
    EXPECT_LT(slopes.low_us, 30);
    for (std::size_t b = 0; b < kErbBandCount; ++b) {
      const double centre_hz = erb_frequency_hz(static_cast<double>(b) + 1.5);
      EXPECT_LE(slopes.share[b], centre_hz < 1600 ? 0 : 0.015) << centre_hz << " Hz";
    }
    EXPECT_LT(slopes.steepest_band_db(), 4);
    RecordProperty("steepest_mdb_per_degree_" + std::to_string(static_cast<int>(axis)),
                   static_cast<int>(1000 * slopes.steepest_band_db()));
    // Below the measured directions, neighbours are far apart.
    EXPECT_LT(all_round.steepest_band_db(), 12);
  }
}

// Neighbours are 5 to 10 degrees apart. A smaller bound than this would exclude the measured HRTF
// itself.
TEST(HrtfRotation, IsAsSteepBetweenNeighboursOfTheMeasuredHrtf) {
  const HrirSet& measured = kemar();
  std::vector<std::array<ErbBands, kEars>> energies;
  for (std::size_t d = 0; d < measured.directions.size(); ++d)
    for (std::size_t e = 0; e < kEars; ++e) {
      if (e == 0) energies.emplace_back();
      energies[d][e] = energy_of(spectrum_of(measured.response(d, e), measured.frames),
                                 measured.rate_hz / kSize);
    }
  double steepest_db = 0;
  for (std::size_t d = 0; d < energies.size(); ++d)
    for (std::size_t other = 0; other < d; ++other) {
      const double apart = std::acos(std::min(
          1.0, static_cast<double>(dot(measured.directions[d], measured.directions[other]))));
      const double degrees = apart * 180 / std::numbers::pi;
      if (degrees > 10.5) continue;
      for (std::size_t e = 0; e < kEars; ++e)
        for (std::size_t b = 0; b < kErbBandCount; ++b)
          steepest_db = std::max(
              steepest_db,
              std::abs(10 * std::log10(energies[d][e][b] / energies[other][e][b])) / degrees);
    }
  EXPECT_GT(steepest_db, 2);
}

// Subdividing a steep step gives many small steps; a jump would stay one step.
TEST(HrtfRotation, IsContinuousInEveryBand) {
  constexpr double kStep_degrees = 0.05;
  constexpr int kParts = 10, kSteps = kSanitized ? 500 : 7200;
  for (const Axis axis : kAxes)
    for (const double off_axis : {0.0, 0.3}) {
      const auto at = [&](double step) {
        return at_ears(on_circle(axis, off_axis, step * kStep_degrees));
      };
      AtEars last = at(0);
      for (int step = 1; step <= kSteps; ++step) {
        const AtEars now = at(step);
        std::vector<AtEars> parts;
        const auto expect_no_jump = [&](double steep, auto value_of) {
          if (std::abs(value_of(now) - value_of(last)) < steep) return;
          for (int p = 0; parts.size() <= kParts; ++p)
            parts.push_back(at(step - 1 + 1.0 * p / kParts));
          double most = 0, sum = 0;
          for (std::size_t p = 1; p < parts.size(); ++p) {
            const double change = std::abs(value_of(parts[p]) - value_of(parts[p - 1]));
            most = std::max(most, change);
            sum += change;
          }
          EXPECT_LT(most, 0.5 * sum) << step * kStep_degrees << " degrees";
        };
        expect_no_jump(1.5, [](const AtEars& ears) { return ears.high_us; });
        for (std::size_t e = 0; e < kEars; ++e)
          for (std::size_t b = 0; b < kErbBandCount; ++b)
            expect_no_jump(0.05, [e, b](const AtEars& ears) { return ears.bands_db[e][b]; });
        last = now;
      }
    }
}

}  // namespace
}  // namespace clamor
