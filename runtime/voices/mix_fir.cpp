#include "runtime/voices/mix_fir.h"

// Highway compiles everything below once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/voices/mix_fir.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Keeps kVectors sums in registers for all rows and taps.
template <int kVectors>
HWY_INLINE int sum_frames(const FirJob& job, int frame) {
  const hn::CappedTag<float, 16> d;
  using Vector = hn::Vec<decltype(d)>;
  constexpr int kFloats = static_cast<int>(hn::MaxLanes(d));
  for (; frame + kVectors * kFloats <= job.frames; frame += kVectors * kFloats) {
    Vector sum[kVectors];
    for (auto& s : sum) s = hn::Zero(d);
    for (int r = 0; r < job.row_count; ++r) {
      const float* HWY_RESTRICT h = job.filters + r * job.taps;
      const float* HWY_RESTRICT x = job.rows + static_cast<std::size_t>(r) * job.row_stride + frame;
      for (int k = 0; k < job.taps; ++k) {
        const auto tap = hn::Set(d, h[k]);
        for (int i = 0; i < kVectors; ++i)
          sum[i] = hn::MulAdd(tap, hn::LoadU(d, x + k + i * kFloats), sum[i]);
      }
    }
    for (int i = 0; i < kVectors; ++i) hn::StoreU(sum[i], d, job.out + frame + i * kFloats);
  }
  return frame;
}

void sum_filtered_here(const FirJob& job) { sum_frames<1>(job, sum_frames<4>(job, 0)); }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(sum_filtered_here);
}  // namespace

void sum_filtered(const FirJob& job) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(sum_filtered_here)(job);
}

}  // namespace clamor

#endif  // HWY_ONCE
