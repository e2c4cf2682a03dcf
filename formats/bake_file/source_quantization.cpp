#include "formats/bake_file/source_quantization.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/material.h"
#include "common/maths.h"
#include "common/random.h"
#include "common/sample_rate.h"

namespace clamor {

namespace {

// Power in half decibels, an integer for rounded powers. 20 lg 2 = 6.02...
double half_decibels(double power) { return 6.0205999132796239 * log2_of(power); }

// Area of a patch in half decibels: 40 lg radius.
double half_decibels_of_area(double radius_m) { return 12.041199826559248 * log2_of(radius_m); }

// half_decibels() of floats, rounded by `rounded`, from a table. Sixteen bins an octave are
// narrower than half a decibel, so that each has at most one step in it.
template <long (*rounded)(double)>
class HalfDecibelTable {
 public:
  HalfDecibelTable() : bins_(kBins) {
    for (std::uint32_t bin = 0; bin < kBins; ++bin) {
      const std::uint32_t first = bin << kShift, last = first | ((1u << kShift) - 1);
      if (first >= kInfinity) break;
      const int below = slow(std::max(first, 1u)), above = slow(last);
      // The first value that belongs above.
      std::uint32_t low = first, high = last;
      while (below != above && high - low > 1) {
        const std::uint32_t middle = low + (high - low) / 2;
        (slow(std::max(middle, 1u)) == below ? low : high) = middle;
      }
      bins_[bin] = {below == above ? kInfinity : high, static_cast<std::int16_t>(below),
                    static_cast<std::int16_t>(above)};
    }
  }

  // Rounds a positive, finite power.
  int operator()(float power) const {
    const auto bits = std::bit_cast<std::uint32_t>(power);
    const Bin& bin = bins_[bits >> kShift];
    return bits < bin.step ? bin.below : bin.above;
  }

 private:
  static constexpr int kShift = 23 - 4;
  static constexpr std::uint32_t kBins = 1u << (31 - kShift), kInfinity = 0x7f800000;
  struct Bin {
    std::uint32_t step = 0;  // bits of the first power with `above`
    std::int16_t below = 0, above = 0;
  };
  static int slow(std::uint32_t bits) {
    return static_cast<int>(
        rounded(half_decibels(static_cast<double>(std::bit_cast<float>(bits)))));
  }

  std::vector<Bin> bins_;
};

long to_nearest(double value) { return std::lround(value); }
long down(double value) { return static_cast<long>(std::floor(value)); }

int nearest_power(float power) {
  static const HalfDecibelTable<to_nearest> table;
  if (!(power > 0)) return kSilent_half_db;
  const int code = table(power);
  return code < kMinPower_half_db ? kSilent_half_db : std::min(code, int{kMaxPower_half_db});
}

int half_decibels_below(float power) {
  static const HalfDecibelTable<down> table;
  return table(power);
}

std::uint16_t radius_code(float radius_m) {
  if (!(radius_m > 0)) return 0;
  const double code = 200 + half_decibels_of_area(std::max(radius_m, 1e-20f));
  return static_cast<std::uint16_t>(std::lround(std::clamp(code, 1.0, kRadiusCodes - 1.0)));
}

Vec3f direction(const std::array<std::uint16_t, 2>& code, int bits) {
  Vec3f v{};
  direction_of(code[0], code[1], direction_scale(bits), v.x, v.y, v.z);
  return v;
}

std::int32_t nearest_step(float position_m) {
  constexpr double kFarthest = 2'000'000'000;  // the reader has narrower limits
  return static_cast<std::int32_t>(std::llround(
      std::clamp(static_cast<double>(position_m) * kPositionSteps_per_m, -kFarthest, kFarthest)));
}

}  // namespace

std::array<std::uint16_t, 2> octahedral_code(const Vec3f& v, int bits) {
  const double sum = static_cast<double>(std::abs(v.x)) + std::abs(v.y) + std::abs(v.z);
  double x = v.x / sum, y = v.y / sum;
  if (v.z < 0) {
    const double folded = (1 - std::abs(y)) * std::copysign(1.0, x);
    y = (1 - std::abs(x)) * std::copysign(1.0, y);
    x = folded;
  }
  const int half = (1 << (bits - 1)) - 1;
  const auto step = [half](double value) {
    return static_cast<std::uint16_t>(std::lround(std::clamp(1 + value, 0.0, 2.0) * half));
  };
  return {step(x), step(y)};
}

const std::array<float, kMaxPower_half_db - kSilent_half_db + 1>& power_table() {
  static const auto table = [] {
    std::array<float, kMaxPower_half_db - kSilent_half_db + 1> powers{};
    for (int c = kMinPower_half_db; c <= kMaxPower_half_db; ++c)
      powers[static_cast<std::size_t>(c - kSilent_half_db)] =
          static_cast<float>(power(10.0, c / 20.0));
    return powers;
  }();
  return table;
}

const std::array<float, kRadiusCodes>& radius_table() {
  static const auto table = [] {
    std::array<float, kRadiusCodes> radii_m{};
    for (int c = 1; c < kRadiusCodes; ++c)
      radii_m[static_cast<std::size_t>(c)] = static_cast<float>(power(10.0, (c - 200) / 40.0));
    return radii_m;
  }();
  return table;
}

int mirror_bits_for(std::span<const Material> materials) {
  float sharpest = 0;
  for (const Material& material : materials)
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (material.scattering[b] < 1) sharpest = std::max(sharpest, heard_exponent(material, b));
  int bits = kMinMirrorBits;
  for (; sharpest > 100 && bits < kMaxMirrorBits; sharpest /= 4) ++bits;
  return bits;
}

QuantizedSource quantized(const Source& source, int mirror_bits) {
  QuantizedSource code;
  for (int axis = 0; axis < 3; ++axis)
    code.position[static_cast<std::size_t>(axis)] = nearest_step(source.position_m[axis]);
  code.delay = static_cast<std::uint32_t>(
      std::llround(static_cast<double>(source.delay_s) * kSampleRate_hz));
  code.normal = octahedral_code(source.normal, kNormalBits);
  code.mirror = octahedral_code(source.mirror, mirror_bits);
  for (std::size_t b = 0; b < kBandCount; ++b)
    code.power[b] = static_cast<std::int16_t>(nearest_power(source.power[b]));
  code.radius = radius_code(source.patch_radius_m);
  code.material = source.material;
  code.emitter = source.emitter;
  return code;
}

Source dequantized(const QuantizedSource& code, int mirror_bits) {
  Source source;
  for (int axis = 0; axis < 3; ++axis)
    source.position_m[axis] = position_m_of(code.position[static_cast<std::size_t>(axis)]);
  source.normal = direction(code.normal, kNormalBits);
  source.mirror = direction(code.mirror, mirror_bits);
  source.delay_s = delay_s_of(code.delay);
  for (std::size_t b = 0; b < kBandCount; ++b) source.power[b] = power_of(code.power[b]);
  source.patch_radius_m = radius_table()[code.radius];
  source.emitter = code.emitter;
  source.material = code.material;
  const std::uint32_t random = source_hash(code);
  source.u = u_from_hash(random);
  source.polarity = polarity_from_hash(random);
  return source;
}

void round_powers_stochastically(Source& source) {
  const auto key = std::uint64_t{std::bit_cast<std::uint32_t>(source.u)} << 32 |
                   std::bit_cast<std::uint32_t>(source.delay_s);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    float& power = source.power[b];
    if (!(power > 0) || power == power_of(nearest_power(power))) continue;
    const int below =
        std::clamp(half_decibels_below(power), kSilent_half_db, kMaxPower_half_db - 1);
    const float low = power_of(below), high = power_of(below + 1);
    const double odds = (static_cast<double>(power) - low) / (static_cast<double>(high) - low);
    const RandomBits bits = philox(key, {static_cast<std::uint32_t>(b), 0x5a9u, 0, 0});
    power = unit(bits[0]) < odds ? high : low;
  }
}

void quantize_sources(std::span<Source> sources, std::span<const Material> materials) {
  const int mirror_bits = mirror_bits_for(materials);
  for (Source& source : sources) {
    if (source.is_emitter) continue;
    round_powers_stochastically(source);
    // Twice, because some directions have two encodings, and u must be the hash of the final one.
    source = dequantized(quantized(source, mirror_bits), mirror_bits);
    source = dequantized(quantized(source, mirror_bits), mirror_bits);
  }
}

}  // namespace clamor
