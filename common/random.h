// random.h: counter-based random numbers.
//
// Philox4x32-10 maps a key and a counter to 128 random bits. The key is the bake's seed; the
// counter names the emitter, photon, bounce and use. There is no state, so threads may draw in any
// order and the bake is the same bytes.
//
// J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw. Parallel Random Numbers: As Easy as 1, 2, 3.
// SC 2011.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace clamor {

using RandomBits = std::array<std::uint32_t, 4>;

inline RandomBits philox(std::uint64_t key, RandomBits counter) {
  auto k0 = static_cast<std::uint32_t>(key);
  auto k1 = static_cast<std::uint32_t>(key >> 32);
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = std::uint64_t{0xD2511F53u} * counter[0];
    const std::uint64_t b = std::uint64_t{0xCD9E8D57u} * counter[2];
    counter = {static_cast<std::uint32_t>(b >> 32) ^ counter[1] ^ k0, static_cast<std::uint32_t>(b),
               static_cast<std::uint32_t>(a >> 32) ^ counter[3] ^ k1,
               static_cast<std::uint32_t>(a)};
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  return counter;
}

// philox() of one key and several counters, word by word, which compilers vectorise.
template <std::size_t kLanes>
void philox_lanes(std::uint64_t key, std::array<std::array<std::uint32_t, kLanes>, 4>& counters) {
  auto k0 = static_cast<std::uint32_t>(key);
  auto k1 = static_cast<std::uint32_t>(key >> 32);
  auto& [c0, c1, c2, c3] = counters;
  for (int round = 0; round < 10; ++round) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::uint64_t a = std::uint64_t{0xD2511F53u} * c0[i];
      const std::uint64_t b = std::uint64_t{0xCD9E8D57u} * c2[i];
      c0[i] = static_cast<std::uint32_t>(b >> 32) ^ c1[i] ^ k0;
      c1[i] = static_cast<std::uint32_t>(b);
      c2[i] = static_cast<std::uint32_t>(a >> 32) ^ c3[i] ^ k1;
      c3[i] = static_cast<std::uint32_t>(a);
    }
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
}

// Purpose of a draw. Part of the counter, so that no two purposes share a random number.
enum class Use : std::uint32_t {
  kEmission,      // direction of an emitted photon
  kReflection,    // lobe, direction, roulette
  kPolarity,      // sign of a secondary source and its permanent random number u
  kPhase,         // random start offset of an emitter
  kEmitter,       // key of an emitter's random numbers, from its name
  kThinning,      // which deposits are kept
  kTransmission,  // sign and u of a source on the far side of a wall
  kStrategy,      // source selection by the paper's strategies
  kWeightWindow,  // which photons end, and the keys of copies
};

// Uniform in [0, 1), in steps of 2^-32.
inline double unit(std::uint32_t bits) { return bits * 0x1p-32; }

// Uniform in (0, 1], so it can be a divisor.
inline double unit_above_zero(std::uint32_t bits) { return (bits + 1.0) * 0x1p-32; }

}  // namespace clamor
