#include "runtime/voices/mix_convolution.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

// Highway compiles everything below once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/voices/mix_convolution.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef CLAMOR_RUNTIME_MIX_SPECTRUM_ONCE
#define CLAMOR_RUNTIME_MIX_SPECTRUM_ONCE
namespace clamor {
namespace {

// Twiddle factors exp(-2 pi i k / kSpectrumSize) of half a circle.
struct Turn {
  float cosine, sine;
};
const std::array<Turn, kSpectrumSize / 2>& turns() noexcept REALTIME {
  static const auto kTurns = [] {
    std::array<Turn, kSpectrumSize / 2> turns;
    for (std::size_t k = 0; k < turns.size(); ++k) {
      const double angle = -2 * std::numbers::pi * static_cast<double>(k) / kSpectrumSize;
      turns[k] = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
    }
    return turns;
  }();
  return kTurns;
}

}  // namespace
}  // namespace clamor
#endif

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<float, kSpectrumLanes>;
constexpr int kFloats = static_cast<int>(hn::MaxLanes(Tag()));
constexpr int kWhole = 128;  // points that fit into L1; larger transforms go stage by stage

// One stage of butterflies over `size` points. The forward transform multiplies by the twiddle
// factor after the difference, the inverse by its conjugate before it.
template <bool kForward>
HWY_INLINE void stage(const Turn* turn, float* HWY_RESTRICT left, float* HWY_RESTRICT right,
                      int size) {
  const Tag d;
  const int half = size / 2, stride = kSpectrumSize / size;
  for (int k = 0; k < half; ++k) {
    const auto c = hn::Set(d, turn[k * stride].cosine), s = hn::Set(d, turn[k * stride].sine);
    for (int lane = 0; lane < kSpectrumLanes; lane += kFloats) {
      const int a = k * kSpectrumLanes + lane, b = a + half * kSpectrumLanes;
      const auto ar = hn::Load(d, left + a), ai = hn::Load(d, right + a);
      const auto br = hn::Load(d, left + b), bi = hn::Load(d, right + b);
      if constexpr (kForward) {
        const auto dr = hn::Sub(ar, br), di = hn::Sub(ai, bi);
        hn::Store(hn::Add(ar, br), d, left + a);
        hn::Store(hn::Add(ai, bi), d, right + a);
        hn::Store(hn::NegMulAdd(di, s, hn::Mul(dr, c)), d, left + b);
        hn::Store(hn::MulAdd(dr, s, hn::Mul(di, c)), d, right + b);
      } else {
        const auto tr = hn::MulAdd(bi, s, hn::Mul(br, c));
        const auto ti = hn::NegMulAdd(br, s, hn::Mul(bi, c));
        hn::Store(hn::Add(ar, tr), d, left + a);
        hn::Store(hn::Add(ai, ti), d, right + a);
        hn::Store(hn::Sub(ar, tr), d, left + b);
        hn::Store(hn::Sub(ai, ti), d, right + b);
      }
    }
  }
}

template <bool kForward>
HWY_NOINLINE void stages(const Turn* turn, float* left, float* right) {
  for (int halvings = 2; halvings <= kWhole; halvings *= 2) {
    const int size = kForward ? 2 * kWhole / halvings : halvings;
    for (int first = 0; first < kWhole; first += size)
      stage<kForward>(turn, left + first * kSpectrumLanes, right + first * kSpectrumLanes, size);
  }
}

template <bool kForward>
void transform(const Turn* turn, float* left, float* right, int size) {
  if (size == kWhole) return stages<kForward>(turn, left, right);
  const int half = size / 2, other = half * kSpectrumLanes;
  if constexpr (kForward) stage<true>(turn, left, right, size);
  transform<kForward>(turn, left, right, half);
  transform<kForward>(turn, left + other, right + other, half);
  if constexpr (!kForward) stage<false>(turn, left, right, size);
}

void filter_pairs_here(const SpectrumJob& job) {
  const Tag d;
  constexpr int kFloatsOfPart = kSpectrumSize * kSpectrumLanes;
  const Turn* const turn = turns().data();
  const int given = job.frames * kSpectrumLanes;
  std::fill_n(job.sum->left, kFloatsOfPart, 0.0f);
  std::fill_n(job.sum->right, kFloatsOfPart, 0.0f);
  for (int group = 0; group < job.groups; ++group) {
    LaneSpectrum& work = *job.work;
    const float* const pair = job.pairs + std::size_t{2} * group * given;
    std::copy_n(pair, given, work.left);
    std::copy_n(pair + given, given, work.right);
    std::fill(work.left + given, work.left + kFloatsOfPart, 0.0f);
    std::fill(work.right + given, work.right + kFloatsOfPart, 0.0f);
    transform<true>(turn, work.left, work.right, kSpectrumSize);
    const float* HWY_RESTRICT h = job.filters + std::size_t{kFloatsOfPart} * group;
    float* HWY_RESTRICT left = job.sum->left;
    float* HWY_RESTRICT right = job.sum->right;
    for (int i = 0; i < kFloatsOfPart; i += kFloats) {
      const auto gain = hn::LoadU(d, h + i);
      hn::Store(hn::MulAdd(gain, hn::Load(d, work.left + i), hn::Load(d, left + i)), d, left + i);
      hn::Store(hn::MulAdd(gain, hn::Load(d, work.right + i), hn::Load(d, right + i)), d,
                right + i);
    }
  }
  transform<false>(turn, job.sum->left, job.sum->right, kSpectrumSize);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(filter_pairs_here);

constexpr int bits_of(int size) { return size == 1 ? 0 : 1 + bits_of(size / 2); }

std::size_t reversed(std::size_t bin) {
  std::size_t result = 0;
  for (int bit = 0; bit < bits_of(kSpectrumSize); ++bit)
    result |= (bin >> bit & 1) << (bits_of(kSpectrumSize) - 1 - bit);
  return result;
}
}  // namespace

void filter_pairs(const SpectrumJob& job) noexcept REALTIME {
  assert(job.frames <= kSpectrumSize);
  HWY_DYNAMIC_DISPATCH(filter_pairs_here)(job);
}

std::vector<float> spectra_of(const std::vector<float>& filters, std::size_t taps) {
  turns();  // compute the table before the audio thread needs it
  constexpr std::size_t kSize = kSpectrumSize, kLanes = kSpectrumLanes;
  const std::size_t count = filters.size() / taps, reach = taps / 2;
  std::vector<double> cosine(kSize);
  for (std::size_t k = 0; k < kSize; ++k)
    cosine[k] = std::cos(2 * std::numbers::pi * static_cast<double>(k) / kSpectrumSize);
  std::vector<float> spectra((count + kLanes - 1) / kLanes * kSize * kLanes);
  for (std::size_t filter = 0; filter < count; ++filter)
    for (std::size_t bin = 0; bin < kSize; ++bin) {
      const float* const middle = &filters[filter * taps + reach];
      double sum = static_cast<double>(middle[0]);
      for (std::size_t k = 1; k <= reach; ++k)
        sum += 2 * static_cast<double>(middle[k]) * cosine[k * bin % kSize];
      spectra[(filter / kLanes * kSize + reversed(bin)) * kLanes + filter % kLanes] =
          static_cast<float>(sum / kSpectrumSize);
    }
  return spectra;
}

}  // namespace clamor

#endif  // HWY_ONCE
