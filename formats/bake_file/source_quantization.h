// source_quantization.h: quantization of secondary sources for the pages of a bake file.
//
//   position    1/256 m, along the axes of the level
//   delay       samples at 48 kHz
//   directions  octahedral mapping; 14 bits per coordinate for the normal, 8 to 12 for the mirror
//               direction (more for sharper lobes)
//   power       half decibels, 1e-24 to 1e24, or silent
//   patch       half decibels of its area, 0.01 mm to 60 000 km of radius, or none
//
// The position error is at most 3.4 mm, so the total path delay is always exact within a sample.
// The steps do not depend on the octree: the bake quantizes once, before it computes keys
// (quantize_sources()), and from then on every source is bit-exact.
//
// The permanent random number u and the polarity are hashes of the quantized values, so they are
// not stored.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "common/maths.h"
#include "common/sample_rate.h"
#include "formats/bake_file/source.h"

namespace clamor {

struct Material;

inline constexpr int kPositionSteps_per_m = 256;
inline constexpr int kNormalBits = 14;
inline constexpr int kMinMirrorBits = 8, kMaxMirrorBits = 12;
inline constexpr int kMaxPower_half_db = 480, kMinPower_half_db = -480;  // half decibels
inline constexpr int kSilent_half_db = kMinPower_half_db - 1;
inline constexpr int kRadiusCodes = 512;

struct QuantizedSource {
  std::array<std::int32_t, 3> position{};
  std::uint32_t delay = 0;
  std::array<std::uint16_t, 2> normal{}, mirror{};
  std::array<std::int16_t, kBandCount> power{};
  std::uint16_t radius = 0;  // 0: none
  std::uint16_t material = 0;
  std::uint32_t emitter = 0;
};

// Bits per coordinate of mirror directions: 8 up to an exponent of 100, one more for every factor
// of 4. A lobe of exponent p has a width of 1 / sqrt(p); the error is at most a tenth of that.
int mirror_bits_for(std::span<const Material> materials);

std::array<std::int32_t, 3> position_code(const Vec3f& position_m);

// Rounds every value to nearest. Call round_powers_stochastically() first for unbiased powers.
QuantizedSource quantized(const Source& source, int mirror_bits);

// Inverse of quantized(); u and polarity are hashes.
Source dequantized(const QuantizedSource& code, int mirror_bits);

// Rounds the power of each band up or down to a half decibel, with probabilities that keep its
// expected value (rounding to nearest has a bias of 0.02 dB). The random number is a function of
// the source.
void round_powers_stochastically(Source& source);

// Replaces each secondary source by its quantized value: powers are rounded stochastically, other
// values to nearest, and u and polarity are drawn again. Emitters are unchanged.
void quantize_sources(std::span<Source> sources, std::span<const Material> materials);

// --- Conversion of single values, for decoding whole columns
// ---------------------------------------

// 10^(c / 20) for c from kMinPower_half_db up; the first element is 0, for kSilent_half_db.
const std::array<float, kMaxPower_half_db - kSilent_half_db + 1>& power_table();
CLAMOR_INLINE float power_of(int half_decibels) {
  return power_table()[static_cast<std::size_t>(half_decibels - kSilent_half_db)];
}

// 10^((c - 200) / 40) m for code c; 0 for code 0.
const std::array<float, kRadiusCodes>& radius_table();

CLAMOR_INLINE float position_m_of(std::int32_t code) {
  return static_cast<float>(code) * (1.0f / kPositionSteps_per_m);
}

CLAMOR_INLINE float delay_s_of(std::uint32_t code) {
  return static_cast<float>(static_cast<double>(code) * (1.0 / kSampleRate_hz));
}

// Rounds a unit direction to the octahedral mapping.
std::array<std::uint16_t, 2> octahedral_code(const Vec3f& v, int bits);

// Decodes the octahedral mapping (Q. Meyer et al. On Floating-Point Normal Vectors. EGSR 2010).
// Coordinates range from 0 to 2^bits - 2, so the axes are exact. Branch-free, so loops vectorise.
CLAMOR_INLINE void direction_of(int a, int b, float scale, float& out_x, float& out_y,
                                float& out_z) {
  float x = static_cast<float>(a) * scale - 1, y = static_cast<float>(b) * scale - 1;
  const float wide_x = x < 0 ? -x : x, wide_y = y < 0 ? -y : y;
  const float z = 1 - wide_x - wide_y;
  const float folded = z < 0 ? -z : 0.0f;
  x += x < 0 ? folded : -folded;
  y += y < 0 ? folded : -folded;
  const float length = std::sqrt(x * x + y * y + z * z);
  out_x = x / length;
  out_y = y / length;
  out_z = z / length;
}
constexpr float direction_scale(int bits) { return 2.0f / static_cast<float>((1 << bits) - 2); }

// 32 random bits from position, delay, emitter and mirror direction of a source. Words are
// multiplied in pairs (32 x 32 bits, which vector units support), and both halves of a product
// enter the next.
CLAMOR_INLINE std::uint32_t source_hash(std::int32_t x, std::int32_t y, std::int32_t z,
                                        std::uint32_t delay, std::uint32_t emitter,
                                        std::uint32_t mirror) {
  std::uint32_t low = 0, high = 0;
  const auto stir = [&low, &high](std::uint32_t a, std::uint32_t b) {
    const std::uint64_t product = std::uint64_t{low ^ a ^ 0x9e3779b9u} * (high ^ b ^ 0xbb67ae85u);
    low = static_cast<std::uint32_t>(product) + b;
    high = static_cast<std::uint32_t>(product >> 32) + a;
  };
  stir(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
  stir(static_cast<std::uint32_t>(z), delay);
  stir(emitter, mirror);
  stir(0x3c6ef372u, 0xa54ff53au);
  stir(0x510e527fu, 0x9b05688cu);
  return low ^ high;
}
CLAMOR_INLINE std::uint32_t source_hash(const QuantizedSource& code) {
  return source_hash(code.position[0], code.position[1], code.position[2], code.delay, code.emitter,
                     code.mirror[0] | std::uint32_t{code.mirror[1]} << 16);
}

// The upper 24 bits determine u, the lowest bit the polarity.
CLAMOR_INLINE float u_from_hash(std::uint32_t random) {
  return static_cast<float>(static_cast<std::int32_t>(random >> 8) + 1) * 0x1p-24f;
}
CLAMOR_INLINE std::int8_t polarity_from_hash(std::uint32_t random) {
  return (random & 1) != 0 ? 1 : -1;
}

}  // namespace clamor
