#include "runtime/propagation/reception.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/maths.h"
#include "common/text.h"
#include "runtime/propagation/loudness.h"

namespace clamor {

namespace {

constexpr double kOrtf_rad = 55 * std::numbers::pi / 180;
constexpr float kCardioid = 2, kWideCardioid = 1;

}  // namespace

Result<ReceiverPattern> ReceiverPattern::named(const std::string& name) {
  if (name == "omni") return ReceiverPattern{};
  if (name == "ortf") return ReceiverPattern{same_in_all_bands(kCardioid), kOrtf_rad};
  if (name == "wide") return ReceiverPattern{same_in_all_bands(kWideCardioid), kOrtf_rad};
  return Error("no receivers are called " + in_quotes(name) +
               "; there are 'omni', 'ortf' and 'wide'.");
}

double ReceiverPattern::diffuse_power() const {
  const Bands weights = loudness_weights();
  double received = 0, all = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    received += static_cast<double>(weights[b]) / (static_cast<double>(exponent[b]) + 1);
    all += static_cast<double>(weights[b]);
  }
  return received / all;
}

Reception::Reception(const ReceiverPattern& pattern, const Listener& listener)
    : exponent_(pattern.exponent),
      same_in_all_bands_(exponent_ == same_in_all_bands(exponent_[0])) {
  if (is_omnidirectional()) return;
  const Vec3 ahead = std::cos(pattern.angle_rad) * listener.forward();
  const Vec3 aside = std::sin(pattern.angle_rad) * listener.right();
  axes_ = {Vec3f(ahead - aside), Vec3f(ahead + aside)};
}

// Sensitivity to the power of `times`: 1 for intensity, 1/2 for amplitude.
Bands Reception::shares(int ear, const Vec3f& towards, float times) const {
  const float length2 = glm::dot(towards, towards);
  const float along = glm::dot(axes_[static_cast<std::size_t>(ear)], towards);
  const float cos_a = length2 > 0 ? along / std::sqrt(length2) : 1;
  const float base = std::clamp((1 + cos_a) / 2, 0.0f, 1.0f);
  const auto share = [&](float exponent) {
    const float p = times * exponent;
    if (p == 1) return base;
    if (p == 2) return base * base;
    if (p == 0) return 1.0f;
    return base > 1e-30f ? exp2_of(p * log2_of(base)) : 0;
  };
  if (same_in_all_bands_) return same_in_all_bands(share(exponent_[0]));
  Bands result;
  for (std::size_t b = 0; b < kBandCount; ++b) result[b] = share(exponent_[b]);
  return result;
}

Bands Reception::gain(int ear, const Vec3f& towards) const { return shares(ear, towards, 0.5f); }

Bands Reception::share(const Vec3f& towards) const {
  Bands mean = shares(0, towards, 1);
  const Bands right = shares(1, towards, 1);
  for (std::size_t b = 0; b < kBandCount; ++b) mean[b] = (mean[b] + right[b]) / 2;
  return mean;
}

}  // namespace clamor
