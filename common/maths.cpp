#include "common/maths.h"

#include <algorithm>
#include <numbers>

namespace clamor {

namespace {

constexpr double kPi = std::numbers::pi;

// Taylor series of sin(x) and cos(x) for |x| <= pi / 4.
double sin_series(double x) {
  const double x2 = x * x;
  double sum = 0;
  for (int k = 21; k >= 3; k -= 2) sum = (sum + 1) * -x2 / (k * (k - 1));
  return x + x * sum;
}

double cos_series(double x) {
  const double x2 = x * x;
  double sum = 0;
  for (int k = 20; k >= 2; k -= 2) sum = (sum + 1) * -x2 / (k * (k - 1));
  return 1 + sum;
}

// Reduces radians to a number of quarter turns and a rest within pi / 4. pi / 2 has two parts for
// accuracy.
struct Quarters {
  std::int64_t count;
  double rest;
};
Quarters quarters_of(double radians) {
  // Their sum is pi / 2.
  constexpr double kHigh = 0x1.921fb54442d00p0, kLow = 0x1.8469898cc5170p-48;
  const double count = std::nearbyint(radians * (2 / kPi));
  return {static_cast<std::int64_t>(count), (radians - count * kHigh) - count * kLow};
}

}  // namespace

double log2_of(double x) {
  int exponent = 0;
  double m = std::frexp(x, &exponent);
  if (m < std::numbers::sqrt2 / 2) {
    m *= 2;
    --exponent;
  }
  const double t = (m - 1) / (m + 1), t2 = t * t;  // |t| <= 0.172
  double sum = 0;
  for (int k = 21; k >= 3; k -= 2) sum = (sum + 1.0 / k) * t2;
  return exponent + 2 * std::numbers::log2e * (t + t * sum);
}

double exp2_of(double x) {
  if (x < -1022) return 0;
  const double n = std::nearbyint(x);
  const double y = (x - n) * std::numbers::ln2;
  double sum = 0;
  for (int k = 16; k >= 1; --k) sum = (sum + 1) * y / k;
  return std::ldexp(1 + sum, static_cast<int>(std::min(n, 1024.0)));
}

double exp_of(double x) { return exp2_of(x * std::numbers::log2e); }

double power(double base, double exponent) {
  if (exponent == 0) return 1;
  if (base <= 0) return 0;
  return exp2_of(exponent * log2_of(base));
}

double sin_of(double radians) {
  const auto [count, rest] = quarters_of(radians);
  const double value = (count & 1) != 0 ? cos_series(rest) : sin_series(rest);
  return (count & 2) != 0 ? -value : value;
}

double cos_of(double radians) {
  const auto [count, rest] = quarters_of(radians);
  const double value = (count & 1) != 0 ? sin_series(rest) : cos_series(rest);
  return ((count + 1) & 2) != 0 ? -value : value;
}

// asin(x) = x + x^3 P(x^2) / Q(x^2) up to 1 / 2, and acos(x) = 2 asin(sqrt((1 - x) / 2)) above.
// Coefficients of Sun Microsystems' fdlibm (e_acos.c, 1993), error below 2^-58.
double acos_of(double x) {
  const auto asin_near_0 = [](double y) {
    const double z = y * y;
    const double p =
        z * (1.66666666666666657415e-01 +
             z * (-3.25565818622400915405e-01 +
                  z * (2.01212532134862925881e-01 +
                       z * (-4.00555345006794114027e-02 +
                            z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05)))));
    const double q =
        1 + z * (-2.40339491173441421878e+00 +
                 z * (2.02094576023350569471e+00 +
                      z * (-6.88283971605453293030e-01 + z * 7.70381505559019352791e-02)));
    return y + y * (p / q);
  };
  if (std::abs(x) <= 0.5) return kPi / 2 - asin_near_0(x);
  const double angle = 2 * asin_near_0(std::sqrt(std::max(0.0, (1 - std::abs(x)) / 2)));
  return x > 0 ? angle : kPi - angle;
}

}  // namespace clamor
