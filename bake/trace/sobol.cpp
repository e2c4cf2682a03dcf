#include "bake/trace/sobol.h"

#include <bit>

#include "common/random.h"

namespace clamor {

namespace {

using BitMatrix = std::array<std::uint32_t, 32>;

// Columns of a generator matrix, from the primitive polynomial of degree `degree` with inner
// coefficients `inner` and the initial direction integers m.
constexpr BitMatrix generator(int degree, std::uint32_t inner, std::array<std::uint32_t, 3> m) {
  BitMatrix v{};
  if (degree == 0) {
    for (int j = 0; j < 32; ++j) v[j] = 1u << (31 - j);
    return v;
  }
  for (int j = 0; j < degree; ++j) v[j] = m[j] << (31 - j);
  for (int j = degree; j < 32; ++j) {
    v[j] = v[j - degree] ^ (v[j - degree] >> degree);
    for (int k = 1; k < degree; ++k)
      if ((inner >> (degree - 1 - k)) & 1) v[j] ^= v[j - k];
  }
  return v;
}

constexpr std::array<BitMatrix, 4> kGenerators = {
    generator(0, 0, {}), generator(1, 0, {1}), generator(2, 1, {1, 3}), generator(3, 1, {1, 3, 1})};

constexpr std::uint32_t reversed(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
  return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
}

// Owen scrambling: each bit is flipped depending on all higher bits and the seed. Burley's
// constants for the Laine-Karras permutation, applied to the reversed number.
constexpr std::uint32_t owen_scrambled(std::uint32_t x, std::uint32_t seed) {
  x = reversed(x);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reversed(x);
}

}  // namespace

std::array<double, 4> sobol_point(std::uint64_t key, std::uint32_t index) {
  const RandomBits seeds = philox(key, {0x50b01u, 0, 0, 0});
  std::array<std::uint32_t, 4> x{};
  for (std::uint32_t bits = index; bits != 0; bits &= bits - 1) {
    const auto j = static_cast<std::size_t>(std::countr_zero(bits));
    for (std::size_t d = 0; d < 4; ++d) x[d] ^= kGenerators[d][j];
  }
  std::array<double, 4> point{};
  for (std::size_t d = 0; d < 4; ++d) point[d] = unit(owen_scrambled(x[d], seeds[d]));
  return point;
}

}  // namespace clamor
