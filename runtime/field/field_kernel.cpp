#include "runtime/field/field_kernel.h"

#include <array>

// Highway compiles everything below once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/field/field_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Eight = hn::CappedTag<float, 8>;

// Adds the gains to successive rows, each time with another weight: a polynomial of the fraction,
// whose coefficients have a value for each row, those of the highest power first.
template <std::size_t kLanes, std::size_t kRows, std::size_t kPowers>
HWY_INLINE void add_rows(const float* HWY_RESTRICT gain, float amplitude, float fraction,
                         const std::array<std::array<float, kRows>, kPowers>& coefficients,
                         float* HWY_RESTRICT rows) {
  const hn::CappedTag<float, kLanes> d;
  for (std::size_t k = 0; k < kRows; ++k) {
    float weight = coefficients[0][k];
    for (std::size_t p = 1; p < kPowers; ++p) weight = weight * fraction + coefficients[p][k];
    const auto times = hn::Set(d, weight * amplitude);
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
      float* const at = rows + k * kLanes + lane;
      hn::StoreU(hn::MulAdd(hn::LoadU(d, gain + lane), times, hn::LoadU(d, at)), d, at);
    }
  }
}

constexpr std::array<std::array<float, 4>, 4> kCubic{{{-1 / 6.0f, 0.5f, -0.5f, 1 / 6.0f},
                                                      {0.5f, -1, 0.5f, 0},
                                                      {-0.5f, 0, 0.5f, 0},
                                                      {1 / 6.0f, 4 / 6.0f, 1 / 6.0f, 0}}};
constexpr std::array<std::array<float, 3>, 3> kQuadratic{
    {{0.5f, -1, 0.5f}, {-0.5f, 0, 0.5f}, {0.125f, 0.75f, 0.125f}}};

void add_taps_here(std::span<const Tap> taps, float* HWY_RESTRICT high, float* HWY_RESTRICT low) {
  for (const Tap& tap : taps) {
    add_rows<kHighFieldLanes>(tap.gain->data() + kBandCount - kHighFieldLanes, tap.amplitude,
                              tap.high_fraction, kCubic,
                              high + (tap.high - 1) * std::ptrdiff_t{kHighFieldLanes});
    add_rows<kLowFieldLanes>(tap.gain->data(), tap.amplitude, tap.low_fraction, kQuadratic,
                             low + (tap.low - 1) * std::ptrdiff_t{kLowFieldLanes});
  }
}

void join_bands_here(const float* HWY_RESTRICT spectrum, const float* HWY_RESTRICT filters,
                     std::size_t points, float* HWY_RESTRICT sum, float* HWY_RESTRICT other) {
  const hn::CappedTag<float, 16> d;
  const std::size_t lanes = hn::Lanes(d);
  // Sums of as many fours of lanes as a vector has lanes.
  const auto sums_at = [&](std::size_t at) {
    alignas(64) std::array<float, 4 * 16> products;
    for (std::size_t i = 0; i < 4 * lanes; i += lanes)
      hn::Store(hn::Mul(hn::LoadU(d, spectrum + at + i), hn::LoadU(d, filters + at + i)), d,
                products.data() + i);
    hn::Vec<decltype(d)> first, second, third, fourth;
    hn::LoadInterleaved4(d, products.data(), first, second, third, fourth);
    return hn::Add(hn::Add(first, second), hn::Add(third, fourth));
  };
  for (std::size_t p = 0; p < points; p += lanes) {
    alignas(64) std::array<float, 2 * 16> sums;
    hn::Store(sums_at(8 * p), d, sums.data());
    hn::Store(sums_at(8 * p + 4 * lanes), d, sums.data() + lanes);
    hn::Vec<decltype(d)> even, odd;
    hn::LoadInterleaved2(d, sums.data(), even, odd);
    hn::StoreU(other == nullptr ? hn::Add(even, odd) : even, d, sum + p);
    if (other != nullptr) hn::StoreU(odd, d, other + p);
  }
}

HWY_INLINE void multiply_add_layer(const float* HWY_RESTRICT a, const float* HWY_RESTRICT b,
                                   std::size_t points, float* HWY_RESTRICT sum) {
  const hn::CappedTag<float, 16> d;
  for (std::size_t p = 0; p < points; p += hn::Lanes(d)) {
    const auto ar = hn::Load(d, a + p), ai = hn::Load(d, a + points + p);
    const auto br = hn::Load(d, b + p), bi = hn::Load(d, b + points + p);
    const auto real = hn::Load(d, sum + p), imaginary = hn::Load(d, sum + points + p);
    hn::Store(hn::NegMulAdd(ai, bi, hn::MulAdd(ar, br, real)), d, sum + p);
    hn::Store(hn::MulAdd(ai, br, hn::MulAdd(ar, bi, imaginary)), d, sum + points + p);
  }
}

void multiply_add_here(const FieldSpectrum& a, const FieldSpectrum& b, FieldSpectrum& sum) {
  multiply_add_layer(a.high.data(), b.high.data(), kHighField.transform, sum.high.data());
  multiply_add_layer(a.low.data(), b.low.data(), kLowField.transform, sum.low.data());
}

void correlate_here(const float* HWY_RESTRICT spectrum, const float* HWY_RESTRICT last,
                    std::size_t points, const SpectrumSums& sums) {
  const Eight d;
  for (std::size_t p = 0; p < points; p += hn::Lanes(d)) {
    const auto ar = hn::LoadU(d, spectrum + p), ai = hn::LoadU(d, spectrum + points + p);
    const auto br = hn::LoadU(d, last + p), bi = hn::LoadU(d, last + points + p);
    const auto add = [&](float* to, const auto& first, const auto& second, const auto& third,
                         const auto& fourth) {
      const auto so_far = hn::LoadU(d, to + p);
      hn::StoreU(hn::MulAdd(first, second, hn::MulAdd(third, fourth, so_far)), d, to + p);
    };
    add(sums.power, ar, ar, ai, ai);
    add(sums.last_power, br, br, bi, bi);
    add(sums.correlation, ar, br, ai, bi);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(add_taps_here);
HWY_EXPORT(join_bands_here);
HWY_EXPORT(multiply_add_here);
HWY_EXPORT(correlate_here);
}  // namespace

void add_taps(std::span<const Tap> taps, float* high, float* low) {
  HWY_DYNAMIC_DISPATCH(add_taps_here)(taps, high, low);
}

void join_bands(const float* spectrum, const float* filters, std::size_t points, float* sum,
                float* other) {
  HWY_DYNAMIC_DISPATCH(join_bands_here)(spectrum, filters, points, sum, other);
}

void multiply_add(const FieldSpectrum& a, const FieldSpectrum& b,
                  FieldSpectrum& sum) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(multiply_add_here)(a, b, sum);
}

void correlate(const float* spectrum, const float* last, std::size_t points,
               const SpectrumSums& sums) {
  HWY_DYNAMIC_DISPATCH(correlate_here)(spectrum, last, points, sums);
}

}  // namespace clamor

#endif  // HWY_ONCE
