#include "runtime/voices/mix_convolution.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "runtime/voices/lane_fourier.h"

// Highway compiles everything below once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/voices/mix_convolution.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<float, kSpectrumLanes>;
constexpr int kFloats = static_cast<int>(hn::MaxLanes(Tag()));

void filter_pairs_here(const SpectrumJob& job, const LaneFourier& fourier) {
  const Tag d;
  constexpr int kFloatsOfPart = kSpectrumSize * kSpectrumLanes;
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
    fourier.forward(work.left, work.right);
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
  fourier.inverse(job.sum->left, job.sum->right);
}

// Four neighbours in an array of doubles, whose alignment `auto` would forget. Highway 1.0.3 has no
// vectors of doubles for WebAssembly.
using Four [[gnu::vector_size(32), gnu::aligned(8), gnu::may_alias]] = double;

// Adds factors[k] x terms[k] to the first term, lane by lane, for k from 1 to `last`. Products are
// rounded before they are added, so that all processors make the same sums.
void sum_terms_here(const double* terms, const double* factors, std::size_t last, double* sums) {
  static_assert(2 * sizeof(Four) == kSpectrumLanes * sizeof(double));
  const Four* term = reinterpret_cast<const Four*>(terms);
  Four low = term[0], high = term[1];
  for (std::size_t k = 1; k <= last; ++k) {
    term += 2;
    low += factors[k] * term[0];
    high += factors[k] * term[1];
  }
  Four* const sum = reinterpret_cast<Four*>(sums);
  sum[0] = low;
  sum[1] = high;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(filter_pairs_here);
HWY_EXPORT(sum_terms_here);

const LaneFourier& spectrum_fourier() noexcept REALTIME {
  static const LaneFourier kFourier(kSpectrumSize, kSpectrumLanes);
  return kFourier;
}
}  // namespace

void filter_pairs(const SpectrumJob& job) noexcept REALTIME {
  assert(job.frames <= kSpectrumSize);
  HWY_DYNAMIC_DISPATCH(filter_pairs_here)(job, spectrum_fourier());
}

std::vector<float> spectra_of(const std::vector<float>& filters, std::size_t taps) {
  // This also computes the tables before the audio thread needs them.
  const LaneFourier& fourier = spectrum_fourier();
  constexpr std::size_t kSize = kSpectrumSize, kLanes = kSpectrumLanes;
  const std::size_t count = filters.size() / taps, reach = taps / 2;
  const std::size_t groups = (count + kLanes - 1) / kLanes;
  std::vector<double> middle(groups * (reach + 1) * kLanes);  // [group][tap from there on][lane]
  for (std::size_t filter = 0; filter < count; ++filter)
    for (std::size_t k = 0; k <= reach; ++k)
      middle[(filter / kLanes * (reach + 1) + k) * kLanes + filter % kLanes] =
          static_cast<double>(filters[filter * taps + reach + k]);
  std::vector<double> cosine(kSize), twice(reach + 1);
  for (std::size_t k = 0; k < kSize; ++k)
    cosine[k] = std::cos(2 * std::numbers::pi * static_cast<double>(k) / kSpectrumSize);
  std::vector<float> spectra(groups * kSize * kLanes);
  std::array<double, kLanes> sum;
  for (std::size_t index = 0; index < kSize; ++index) {
    for (std::size_t k = 1; k <= reach; ++k) twice[k] = 2 * cosine[k * fourier.bin(index) % kSize];
    for (std::size_t group = 0; group < groups; ++group) {
      HWY_DYNAMIC_DISPATCH(sum_terms_here)
      (&middle[group * (reach + 1) * kLanes], twice.data(), reach, sum.data());
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        spectra[(group * kSize + index) * kLanes + lane] =
            static_cast<float>(sum[lane] / kSpectrumSize);
    }
  }
  return spectra;
}

}  // namespace clamor

#endif  // HWY_ONCE
