// trace_vectors-inl.h: vectors of eight bands, and random numbers in every lane.
//
// Compiled once per instruction set, by bake/trace/trace_kernel.cpp.
#if defined(CLAMOR_BAKE_TRACE_VECTORS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_BAKE_TRACE_VECTORS_INL_H_
#undef CLAMOR_BAKE_TRACE_VECTORS_INL_H_
#else
#define CLAMOR_BAKE_TRACE_VECTORS_INL_H_
#endif

#include <hwy/highway.h>

#include "bake/trace/trace_columns.h"
#include "common/maths_lanes-inl.h"
#include "common/random.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

static_assert(kBandCount == 8, "sum_of() and max_of() add and compare eight bands");

// Eight bands in one register, if the instruction set has one of that size.
typedef float BandVector __attribute__((vector_size(4 * kBandCount)));
typedef float FourFloats __attribute__((vector_size(16)));

CLAMOR_INLINE BandVector load(const Bands& bands) {
  BandVector vector;
  __builtin_memcpy(&vector, bands.data(), sizeof vector);
  return vector;
}
CLAMOR_INLINE void store(BandVector vector, Bands& bands) {
  __builtin_memcpy(bands.data(), &vector, sizeof vector);
}

// Sum and maximum of eight bands, evaluated in the same order on every machine.
CLAMOR_INLINE float sum_of(BandVector x) {
  const FourFloats four =
      __builtin_shufflevector(x, x, 0, 1, 2, 3) + __builtin_shufflevector(x, x, 4, 5, 6, 7);
  const FourFloats two = four + __builtin_shufflevector(four, four, 2, 3, 2, 3);
  return two[0] + two[1];
}
CLAMOR_INLINE float max_of(BandVector x) {
  const FourFloats low = __builtin_shufflevector(x, x, 0, 1, 2, 3);
  const FourFloats high = __builtin_shufflevector(x, x, 4, 5, 6, 7);
  const FourFloats four = low > high ? low : high;
  const FourFloats turned = __builtin_shufflevector(four, four, 2, 3, 2, 3);
  const FourFloats two = four > turned ? four : turned;
  return two[0] > two[1] ? two[0] : two[1];
}

// Uniform in [0, 1), with 24 bits.
CLAMOR_INLINE float unit_of(std::uint32_t bits) {
  return static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24f;
}

// Philox of common/random.h for the first `count` keys and photons, rounded up to kLanes.
void draw(const ShadeScratch& scratch, std::size_t count, std::uint32_t bounce, Use use,
          RandomColumns& out) {
  for (std::size_t first = 0; first < count; first += kLanes) {
    alignas(64) std::uint32_t c[4][kLanes], k[2][kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) {
      c[0][i] = scratch.number[0][first + i];
      c[1][i] = scratch.number[1][first + i];
      c[2][i] = bounce;
      c[3][i] = static_cast<std::uint32_t>(use);
      k[0][i] = scratch.key[0][first + i];
      k[1][i] = scratch.key[1][first + i];
    }
    for (int round = 0; round < 10; ++round) {
      for (std::size_t i = 0; i < kLanes; ++i) {
        const std::uint64_t a = std::uint64_t{0xD2511F53u} * c[0][i];
        const std::uint64_t b = std::uint64_t{0xCD9E8D57u} * c[2][i];
        const std::uint32_t c1 = c[1][i], c3 = c[3][i];
        c[0][i] = static_cast<std::uint32_t>(b >> 32) ^ c1 ^ k[0][i];
        c[1][i] = static_cast<std::uint32_t>(b);
        c[2][i] = static_cast<std::uint32_t>(a >> 32) ^ c3 ^ k[1][i];
        c[3][i] = static_cast<std::uint32_t>(a);
        k[0][i] += 0x9E3779B9u;
        k[1][i] += 0xBB67AE85u;
      }
    }
    for (std::size_t w = 0; w < 4; ++w)
      for (std::size_t i = 0; i < kLanes; ++i) out.words[w][first + i] = c[w][i];
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif  // CLAMOR_BAKE_TRACE_VECTORS_INL_H_
