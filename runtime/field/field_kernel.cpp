#include "runtime/field/field_kernel.h"

#include <array>
#include <type_traits>

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

using Sixteen = hn::CappedTag<float, 16>;
using Halves = hn::Rebind<hwy::float16_t, Sixteen>;

HWY_INLINE hn::Vec<Sixteen> load(const std::uint16_t* at) {
  return hn::PromoteTo(Sixteen(), hn::Load(Halves(), reinterpret_cast<const hwy::float16_t*>(at)));
}

// Rounds to the nearest number of half precision. Highway's conversion does that where processors
// have one, and cuts elsewhere.
HWY_INLINE hn::Vec<Sixteen> rounded(hn::Vec<Sixteen> number) {
  const hn::RebindToUnsigned<Sixteen> du;
  constexpr int kDropped = 13;  // bits of the mantissa
  constexpr std::uint32_t kHalf = 1u << (kDropped - 1);
  const auto bits = hn::BitCast(du, number);
  const auto is_odd = hn::And(hn::ShiftRight<kDropped>(bits), hn::Set(du, 1u));
  const auto raised = hn::Add(bits, hn::Add(is_odd, hn::Set(du, kHalf - 1)));
  return hn::BitCast(Sixteen(), hn::And(raised, hn::Set(du, ~(2 * kHalf - 1))));
}

// Returns the scale. Half precision is right within 2^-11 down to -168 dB of the largest number.
template <std::size_t kSize>
HWY_INLINE float pack_layer(const std::array<float, kSize>& from,
                            std::array<std::uint16_t, kSize>& to) {
  const Sixteen d;
  auto largest = hn::Zero(d);
  for (std::size_t i = 0; i < kSize; i += hn::Lanes(d))
    largest = hn::Max(largest, hn::Abs(hn::Load(d, from.data() + i)));
  constexpr float kLargest = 1 << 14;
  float scale = hn::GetLane(hn::MaxOfLanes(d, largest)) / kLargest;
  if (scale < 1e-30f) scale = 0;  // whose inverse may be infinite
  const auto over = hn::Set(d, scale > 0 ? 1 / scale : 0);
  for (std::size_t i = 0; i < kSize; i += hn::Lanes(d))
    hn::Store(hn::DemoteTo(Halves(), rounded(hn::Mul(hn::Load(d, from.data() + i), over))),
              Halves(), reinterpret_cast<hwy::float16_t*>(to.data() + i));
  return scale;
}

void pack_here(const FieldSums& from, FieldSpectrum& to) {
  to.high_scale = pack_layer(from.high, to.high);
  to.low_scale = pack_layer(from.low, to.low);
}

template <auto kLayer, auto kSum, auto kScale, std::size_t kCount>
HWY_INLINE void multiply_add_layer(const SpectrumProduct* products, FieldSums& all) {
  const Sixteen d;
  const std::size_t points = (all.*kSum).size() / 2;
  float* HWY_RESTRICT const sum = (all.*kSum).data();
  std::array<const std::uint16_t*, kCount> a, b;
  std::array<float, kCount> scales;
  for (std::size_t k = 0; k < kCount; ++k) {
    a[k] = (products[k].a->*kLayer).data();
    b[k] = (products[k].b->*kLayer).data();
    scales[k] = products[k].a->*kScale * products[k].b->*kScale;
  }
  for (std::size_t p = 0; p < points; p += hn::Lanes(d)) {
    auto real = hn::Load(d, sum + p), imaginary = hn::Load(d, sum + points + p);
    for (std::size_t k = 0; k < kCount; ++k) {
      const auto scale = hn::Set(d, scales[k]);
      const auto ar = load(a[k] + p), ai = load(a[k] + points + p);
      const auto br = hn::Mul(scale, load(b[k] + p)), bi = hn::Mul(scale, load(b[k] + points + p));
      real = hn::NegMulAdd(ai, bi, hn::MulAdd(ar, br, real));
      imaginary = hn::MulAdd(ai, br, hn::MulAdd(ar, bi, imaginary));
    }
    hn::Store(real, d, sum + p);
    hn::Store(imaginary, d, sum + points + p);
  }
}

// Four products at a time, so that the sum is seldom loaded.
void multiply_add_here(std::span<const SpectrumProduct> products, FieldSums& sum) {
  const auto add = [&]<std::size_t kCount>(std::integral_constant<std::size_t, kCount>) {
    for (; products.size() >= kCount; products = products.subspan(kCount)) {
      multiply_add_layer<&FieldSpectrum::high, &FieldSums::high, &FieldSpectrum::high_scale,
                         kCount>(products.data(), sum);
      multiply_add_layer<&FieldSpectrum::low, &FieldSums::low, &FieldSpectrum::low_scale, kCount>(
          products.data(), sum);
    }
  };
  add(std::integral_constant<std::size_t, 4>());
  add(std::integral_constant<std::size_t, 1>());
}

template <std::size_t kSize>
HWY_INLINE void correlate_layer(const std::array<std::uint16_t, kSize>& now, float scale,
                                const std::array<std::uint16_t, kSize>& last, float last_scale,
                                const SpectrumSums& sums) {
  const Sixteen d;
  constexpr std::size_t kPoints = kSize / 2;
  const auto a = hn::Set(d, scale), b = hn::Set(d, last_scale);
  for (std::size_t p = 0; p < kPoints; p += hn::Lanes(d)) {
    const auto ar = hn::Mul(a, load(&now[p])), ai = hn::Mul(a, load(&now[kPoints + p]));
    const auto br = hn::Mul(b, load(&last[p])), bi = hn::Mul(b, load(&last[kPoints + p]));
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

void correlate_here(const FieldSpectrum& now, const FieldSpectrum& last, const SpectrumSums& high,
                    const SpectrumSums& low) {
  correlate_layer(now.high, now.high_scale, last.high, last.high_scale, high);
  correlate_layer(now.low, now.low_scale, last.low, last.low_scale, low);
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
HWY_EXPORT(pack_here);
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

void pack(const FieldSums& from, FieldSpectrum& to) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(pack_here)(from, to);
}

void multiply_add(std::span<const SpectrumProduct> products, FieldSums& sum) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(multiply_add_here)(products, sum);
}

void correlate(const FieldSpectrum& now, const FieldSpectrum& last, const SpectrumSums& high,
               const SpectrumSums& low) {
  HWY_DYNAMIC_DISPATCH(correlate_here)(now, last, high, low);
}

}  // namespace clamor

#endif  // HWY_ONCE
