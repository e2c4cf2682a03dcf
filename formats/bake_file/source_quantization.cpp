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

// A function of positive floats, rounded by `rounded`, from a table of 2^kBits bins an octave. The
// function rises by less than one within a bin, so that each has at most one step in it. (Denormal
// floats share a bin; their values only have to stay far below all that a file can hold.)
template <double (*function)(double), long (*rounded)(double), int kBits>
class RoundedTable {
 public:
  RoundedTable() : bins_(kBins) {
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

  // The value of a normal, positive float.
  int operator()(float value) const {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const Bin& bin = bins_[bits >> kShift];
    return bits < bin.step ? bin.below : bin.above;
  }

 private:
  static constexpr int kShift = 23 - kBits;
  static constexpr std::uint32_t kBins = 1u << (31 - kShift), kInfinity = 0x7f800000;
  struct Bin {
    std::uint32_t step = 0;  // bits of the first float with `above`
    std::int16_t below = 0, above = 0;
  };
  static int slow(std::uint32_t bits) {
    return static_cast<int>(rounded(function(static_cast<double>(std::bit_cast<float>(bits)))));
  }

  std::vector<Bin> bins_;
};

long to_nearest(double value) { return std::lround(value); }
long down(double value) { return static_cast<long>(std::floor(value)); }

int nearest_power(float power) {
  static const RoundedTable<half_decibels, to_nearest, 4> table;
  if (!(power > 0)) return kSilent_half_db;
  const int code = table(power);
  return code < kMinPower_half_db ? kSilent_half_db : std::min(code, int{kMaxPower_half_db});
}

int half_decibels_below(float power) {
  static const RoundedTable<half_decibels, down, 4> table;
  return table(power);
}

std::uint16_t radius_code(float radius_m) {
  static const RoundedTable<half_decibels_of_area, to_nearest, 5> table;
  if (!(radius_m > 0)) return 0;
  const float finite_m = std::clamp(radius_m, 1e-20f, 1e20f);
  return static_cast<std::uint16_t>(std::clamp(200 + table(finite_m), 1, kRadiusCodes - 1));
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

std::uint32_t nearest_sample(float delay_s) {
  return static_cast<std::uint32_t>(std::llround(static_cast<double>(delay_s) * kSampleRate_hz));
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
    return static_cast<std::uint16_t>(std::clamp(1 + value, 0.0, 2.0) * half + 0.5);
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

std::array<std::int32_t, 3> position_code(const Vec3f& position_m) {
  return {nearest_step(position_m.x), nearest_step(position_m.y), nearest_step(position_m.z)};
}

QuantizedSource quantized(const Source& source, int mirror_bits) {
  QuantizedSource code;
  code.position = position_code(source.position_m);
  code.delay = nearest_sample(source.delay_s);
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

namespace {

// The first word of philox(key, {band, 0x5a9, 0, 0}) for each band, in loops that are vectorised.
std::array<std::uint32_t, kBandCount> rounding_bits(std::uint64_t key) {
  std::array<std::array<std::uint32_t, kBandCount>, 4> counter{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    counter[0][b] = static_cast<std::uint32_t>(b);
    counter[1][b] = 0x5a9u;
  }
  philox_lanes(key, counter);
  return counter[0];
}

// Half decibels of the bands' powers, each rounded up or down at random.
std::array<std::int16_t, kBandCount> stochastic_codes(const Source& source) {
  const auto key = std::uint64_t{std::bit_cast<std::uint32_t>(source.u)} << 32 |
                   std::bit_cast<std::uint32_t>(source.delay_s);
  const auto bits = rounding_bits(key);
  std::array<std::int16_t, kBandCount> codes{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float power = source.power[b];
    int code = kSilent_half_db;
    if (power > 0) {
      code = std::clamp(half_decibels_below(power), kSilent_half_db, kMaxPower_half_db - 1);
      // The odds of the upper value; 0 or 1 for a power that is rounded already.
      const double low = power_of(code), high = power_of(code + 1);
      if (unit(bits[b]) * (high - low) < power - low) ++code;
    }
    codes[b] = static_cast<std::int16_t>(code);
  }
  return codes;
}

// Rounds a direction to one that is rounded to itself, and returns its code. Some directions have
// two encodings, and the first rounding may yield the other one.
std::array<std::uint16_t, 2> round_direction(Vec3f& v, int bits) {
  const auto first = octahedral_code(v, bits);
  v = direction(first, bits);
  const auto code = octahedral_code(v, bits);
  if (code != first) v = direction(code, bits);
  return code;
}

}  // namespace

void round_powers_stochastically(Source& source) {
  const auto codes = stochastic_codes(source);
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (source.power[b] > 0) source.power[b] = power_of(codes[b]);
}

void quantize_sources(std::span<Source> sources, std::span<const Material> materials) {
  const int mirror_bits = mirror_bits_for(materials);
  for (Source& source : sources) {
    if (source.is_emitter) continue;
    const auto powers = stochastic_codes(source);
    for (std::size_t b = 0; b < kBandCount; ++b) source.power[b] = power_of(powers[b]);
    std::array<std::int32_t, 3> position{};
    for (int axis = 0; axis < 3; ++axis) {
      std::int32_t& code = position[static_cast<std::size_t>(axis)];
      code = nearest_step(position_m_of(nearest_step(source.position_m[axis])));
      source.position_m[axis] = position_m_of(code);
    }
    const std::uint32_t delay = nearest_sample(delay_s_of(nearest_sample(source.delay_s)));
    source.delay_s = delay_s_of(delay);
    round_direction(source.normal, kNormalBits);
    const auto mirror = round_direction(source.mirror, mirror_bits);
    source.patch_radius_m = radius_table()[radius_code(source.patch_radius_m)];
    const std::uint32_t random =
        source_hash(position[0], position[1], position[2], delay, source.emitter,
                    mirror[0] | std::uint32_t{mirror[1]} << 16);
    source.u = u_from_hash(random);
    source.polarity = polarity_from_hash(random);
  }
}

}  // namespace clamor
