// culler_lanes-inl.h: what the kernels that bound priorities have in common, 16 sources at a time:
// for source_culler_kernel.cpp and shortlist_kernel.cpp alone, which compile it once per
// instruction set; hence no include guard of the usual kind.
#if defined(CLAMOR_RUNTIME_SIEVE_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_RUNTIME_SIEVE_LANES_INL_H
#undef CLAMOR_RUNTIME_SIEVE_LANES_INL_H
#else
#define CLAMOR_RUNTIME_SIEVE_LANES_INL_H
#endif

#include <array>
#include <cstddef>
#include <cstdint>

#include <hwy/highway.h>

#include "runtime/query/source_culler.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, kCullBlock>;
using Vector = hn::Vec<Tag>;

struct Vectors {
  Vector x, y, z;
};

HWY_INLINE Vectors load(Tag d, const std::array<CullBlock::Row, 3>& rows, std::size_t at) {
  return {hn::Load(d, rows[0].data() + at), hn::Load(d, rows[1].data() + at),
          hn::Load(d, rows[2].data() + at)};
}

HWY_INLINE Vector dot(const Vectors& a, const Vectors& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

// exp(-t) for t >= 0, within 1e-4; never below 2^-100.
HWY_INLINE Vector decay(Tag d, Vector t) {
  const hn::RebindToSigned<Tag> di;
  const auto y = hn::Min(hn::Mul(t, hn::Set(d, 1.44269504f)), hn::Set(d, 100.0f));
  const auto whole = hn::Round(y);
  const auto z = hn::Sub(whole, y);  // 2^z, z in [-1/2, 1/2], by the Taylor series
  auto part = hn::MulAdd(z, hn::Set(d, 0.00961813f), hn::Set(d, 0.05550411f));
  part = hn::MulAdd(part, z, hn::Set(d, 0.24022651f));
  part = hn::MulAdd(part, z, hn::Set(d, 0.69314718f));
  part = hn::MulAdd(part, z, hn::Set(d, 1.0f));
  const auto exponent = hn::Sub(hn::Set(di, 127), hn::ConvertTo(di, whole));
  return hn::Mul(part, hn::BitCast(d, hn::ShiftLeft<23>(exponent)));
}

// Factor of a lobe below the angle of incidence: cos o / cos i, at most 1.
HWY_INLINE Vector tilt_of(Tag d, Vector cos_o, const Vectors& normal, const Vectors& mirror,
                          hn::Mask<Tag> is_emitter) {
  const auto one = hn::Set(d, 1.0f), rounds = hn::Set(d, 1e-6f);
  const auto cos_i = hn::Max(hn::Sub(dot(mirror, normal), rounds), rounds);
  return hn::IfThenElse(is_emitter, one, hn::Min(hn::Div(cos_o, cos_i), one));
}

// Maximum of bounce x exp(-slope x) over all x up to this cosine, 0 to 1; the peak is at 1 / slope.
// 0 for an emitter.
HWY_INLINE Vector bounce_up_to(Tag d, Vector cos_o, Vector bounce, Vector slope) {
  slope = hn::Max(slope, hn::Set(d, 1e-6f));
  const auto x = hn::Min(cos_o, hn::Div(hn::Set(d, 1.0f), slope));
  return hn::Mul(hn::Mul(bounce, x), decay(d, hn::Mul(slope, x)));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
