#include "runtime/voices/lane_fourier.h"

#include <bit>
#include <cassert>
#include <cmath>
#include <numbers>

// Highway compiles everything below once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/voices/lane_fourier.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Turn = LaneFourier::Turn;
using Way = LaneFourier::Way;

template <class D>
struct Complex {
  hn::Vec<D> real, imaginary;
};
template <class D>
HWY_INLINE Complex<D> operator+(const Complex<D>& a, const Complex<D>& b) {
  return {hn::Add(a.real, b.real), hn::Add(a.imaginary, b.imaginary)};
}
template <class D>
HWY_INLINE Complex<D> operator-(const Complex<D>& a, const Complex<D>& b) {
  return {hn::Sub(a.real, b.real), hn::Sub(a.imaginary, b.imaginary)};
}
// b times i.
template <class D>
HWY_INLINE Complex<D> quarter_turn(const Complex<D>& b) {
  return {hn::Neg(b.imaginary), b.real};
}
// Times `turn`, or its conjugate.
template <bool kForward, class D>
HWY_INLINE Complex<D> turned(D d, const Complex<D>& a, const Turn& turn) {
  const auto c = hn::Set(d, turn.cosine), s = hn::Set(d, kForward ? turn.sine : -turn.sine);
  return {hn::NegMulAdd(a.imaginary, s, hn::Mul(a.real, c)),
          hn::MulAdd(a.real, s, hn::Mul(a.imaginary, c))};
}

template <std::size_t kLanes>
struct Transform {
  using Tag = hn::CappedTag<float, kLanes>;
  const Turn* turns;
  std::size_t size;
  float *real, *imaginary;

  HWY_INLINE Complex<Tag> load(std::size_t at) const {
    return {hn::Load(Tag(), real + at), hn::Load(Tag(), imaginary + at)};
  }
  HWY_INLINE void store(const Complex<Tag>& value, std::size_t at) const {
    hn::Store(value.real, Tag(), real + at);
    hn::Store(value.imaginary, Tag(), imaginary + at);
  }

  // The butterflies of `points` points from `first` on, whose quarters then have transforms of
  // their own. The second half may be known to be zero.
  template <bool kForward, bool kIsHalf = false>
  HWY_INLINE void butterflies(std::size_t first, std::size_t points) const {
    const Tag d;
    const std::size_t quarter = points / 4, stride = size / points;
    for (std::size_t k = 0; k < quarter; ++k) {
      const Turn one = turns[k * stride], two = turns[2 * k * stride],
                 three = turns[3 * k * stride];
      for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
        const std::size_t a = (first + k) * kLanes + lane, step = quarter * kLanes;
        Complex<Tag> p = load(a), q = load(a + step);
        if constexpr (kIsHalf) {
          const Complex<Tag> odd2 = quarter_turn(q);
          store(p + q, a);
          store(turned<true>(d, p - q, two), a + step);
          store(turned<true>(d, p - odd2, one), a + 2 * step);
          store(turned<true>(d, p + odd2, three), a + 3 * step);
          continue;
        }
        Complex<Tag> r = load(a + 2 * step), s = load(a + 3 * step);
        if constexpr (kForward) {
          const Complex<Tag> even = p + r, odd = p - r, even2 = q + s, odd2 = quarter_turn(q - s);
          store(even + even2, a);
          store(turned<true>(d, even - even2, two), a + step);
          store(turned<true>(d, odd - odd2, one), a + 2 * step);
          store(turned<true>(d, odd + odd2, three), a + 3 * step);
        } else {
          q = turned<false>(d, q, two);
          r = turned<false>(d, r, one);
          s = turned<false>(d, s, three);
          const Complex<Tag> even = p + q, odd = p - q, even2 = r + s, odd2 = quarter_turn(r - s);
          store(even + even2, a);
          store(odd + odd2, a + step);
          store(even - even2, a + 2 * step);
          store(odd - odd2, a + 3 * step);
        }
      }
    }
  }
  void pairs(std::size_t first) const {
    for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(Tag())) {
      const std::size_t a = first * kLanes + lane;
      const Complex<Tag> p = load(a), q = load(a + kLanes);
      store(p + q, a);
      store(p - q, a + kLanes);
    }
  }

  // Recursive, so that parts stay in the cache.
  template <bool kForward, bool kIsHalf = false>
  void run(std::size_t first, std::size_t points) const {
    if (points == 1) return;
    if (points == 2) return pairs(first);
    if constexpr (kForward) butterflies<true, kIsHalf>(first, points);
    if (points > 4)
      for (std::size_t part = 0; part < 4; ++part)
        run<kForward>(first + part * points / 4, points / 4);
    if constexpr (!kForward) butterflies<false>(first, points);
  }
};

void transform_here(Way way, std::size_t lanes, const Turn* turns, std::size_t size, float* real,
                    float* imaginary) {
  const auto run = [&](const auto& transform) {
    if (way == Way::kForward)
      transform.template run<true>(0, size);
    else if (way == Way::kForwardOfHalf)
      transform.template run<true, true>(0, size);
    else
      transform.template run<false>(0, size);
  };
  if (lanes == 8)
    run(Transform<8>{turns, size, real, imaginary});
  else
    run(Transform<4>{turns, size, real, imaginary});
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(transform_here);

std::size_t bin_at(std::size_t index, std::size_t size) {
  if (size <= 2) return index;
  constexpr std::size_t kPart[] = {0, 2, 1, 3};
  return 4 * bin_at(index % (size / 4), size / 4) + kPart[index / (size / 4)];
}
}  // namespace

LaneFourier::LaneFourier(std::size_t size, std::size_t lanes)
    : lanes_(lanes), bins_(size), turns_(size) {
  assert(std::has_single_bit(size) && (lanes == 4 || lanes == 8));
  for (std::size_t k = 0; k < size; ++k) {
    const double angle = -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(size);
    turns_[k] = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
    bins_[k] = bin_at(k, size);
  }
}

void LaneFourier::forward(float* real, float* imaginary) const noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(transform_here)
  (Way::kForward, lanes_, turns_.data(), size(), real, imaginary);
}

void LaneFourier::forward_of_half(float* real, float* imaginary) const noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(transform_here)
  (Way::kForwardOfHalf, lanes_, turns_.data(), size(), real, imaginary);
}

void LaneFourier::inverse(float* real, float* imaginary) const noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(transform_here)
  (Way::kInverse, lanes_, turns_.data(), size(), real, imaginary);
}

}  // namespace clamor

#endif  // HWY_ONCE
