#include "formats/bake_file/source_quantization.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "common/material.h"
#include "common/maths.h"
#include "common/random.h"

namespace clamor {
namespace {

Vec3f direction(std::uint32_t i) {
  const RandomBits a = philox(21, {i, 0, 0, 0});
  return Vec3f(normalize(Vec3(unit(a[0]) - 0.5, unit(a[1]) - 0.5, unit(a[2]) - 0.5)));
}

Source anywhere(std::uint32_t i) {
  const RandomBits a = philox(22, {i, 0, 0, 0}), b = philox(22, {i, 1, 0, 0});
  Source source;
  source.position_m = Vec3f(Vec3(unit(a[0]), unit(a[1]), unit(a[2])) * 400.0 - 200.0);
  source.normal = direction(2 * i);
  source.mirror = direction(2 * i + 1);
  source.delay_s = static_cast<float>(10 * unit(a[3]));
  for (std::size_t k = 0; k < kBandCount; ++k)
    source.power[k] = static_cast<float>(std::pow(10, -12 * unit(philox(22, {i, 2, 0, 0})[0])));
  source.patch_radius_m = static_cast<float>(std::pow(10, 5 * unit(b[0]) - 3));
  source.u = static_cast<float>(unit_above_zero(b[1]));
  source.emitter = b[2] % 100;
  return source;
}

std::vector<Source> many(std::uint32_t count) {
  std::vector<Source> sources;
  for (std::uint32_t i = 0; i < count; ++i) sources.push_back(anywhere(i));
  return sources;
}

Material shiny(float exponent) {
  Material material;
  material.scattering = same_in_all_bands(0.5f);
  material.phong = same_in_all_bands(exponent);
  return material;
}

TEST(SourceQuantization, NeverChangesAPathDelayByAWholeSample) {
  const std::vector<Source> before = many(20000);
  std::vector<Source> after = before;
  quantize_sources(after, {});
  double max_m = 0, max_samples = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double moved_m = length(Vec3(after[i].position_m) - Vec3(before[i].position_m));
    const double late_s = std::abs(static_cast<double>(after[i].delay_s) - before[i].delay_s);
    max_m = std::max(max_m, moved_m);
    max_samples = std::max(max_samples, (late_s + moved_m / 331) * kSampleRate_hz);  // at 0 C
  }
  EXPECT_LT(max_m, std::sqrt(3.0) / 512 + 1e-5);
  EXPECT_LT(max_samples, 1);
  EXPECT_GT(max_samples, 0.8);  // and the bound is nearly reached
}

TEST(SourceQuantization, KeepsDirectionsWithinTheWidthOfTheirLobes) {
  for (const float exponent : {0.f, 20.f, 100.f, 101.f, 400.f, 1000.f}) {
    const std::vector<Material> materials = {shiny(exponent)};
    const std::vector<Source> before = many(5000);
    std::vector<Source> after = before;
    quantize_sources(after, materials);
    double normals = 0, mirrors = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      normals = std::max<double>(normals, length(after[i].normal - before[i].normal));
      mirrors = std::max<double>(mirrors, length(after[i].mirror - before[i].mirror));
    }
    EXPECT_LT(normals, 2.7e-4);
    EXPECT_LT(mirrors, 0.018);
    EXPECT_LT(mirrors, 0.18 / std::sqrt(std::max(exponent, 1.f))) << exponent;
  }
}

TEST(SourceQuantization, KeepsTheAxesExact) {
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {1.f, -1.f}) {
      Source source = anywhere(1);
      source.normal = source.mirror = Vec3f(0);
      source.normal[axis] = source.mirror[axis] = sign;
      const Source before = source;
      quantize_sources(std::span(&source, 1), {});
      EXPECT_EQ(source.normal, before.normal);
      EXPECT_EQ(source.mirror, before.mirror);
    }
}

TEST(SourceQuantization, KeepsPatchesWithinAQuarterOfADecibelOfTheirArea) {
  std::vector<Source> sources = many(2000);
  sources[0].patch_radius_m = 0;
  const std::vector<Source> before = sources;
  quantize_sources(sources, {});
  EXPECT_EQ(sources[0].patch_radius_m, 0);
  for (std::size_t i = 1; i < sources.size(); ++i)
    EXPECT_LE(std::abs(20 * std::log10(sources[i].patch_radius_m / before[i].patch_radius_m)),
              0.2501);
}

// Powers are rounded by a table; around each of its steps it has to round as the logarithm does.
TEST(SourceQuantization, RoundsPowersToTheNearestHalfDecibel) {
  const auto expect_nearest = [](float power) {
    Source source;
    source.normal = source.mirror = {0, 0, 1};
    source.power = same_in_all_bands(power);
    const double nearest = std::round(6.0205999132796239 * log2_of(static_cast<double>(power)));
    const double code = nearest < kMinPower_half_db ? kSilent_half_db
                                                    : std::min<double>(nearest, kMaxPower_half_db);
    ASSERT_EQ(quantized(source, kMinMirrorBits).power[0], code) << power;
  };
  for (int c = kMinPower_half_db - 3; c < kMaxPower_half_db + 3; ++c) {
    const auto step = static_cast<float>(std::pow(10, (c + 0.5) / 20));
    for (std::int32_t ulp = -3; ulp <= 3; ++ulp)
      expect_nearest(std::bit_cast<float>(std::bit_cast<std::int32_t>(step) + ulp));
  }
  for (std::uint32_t i = 0; i < 20'000; ++i)
    expect_nearest(std::bit_cast<float>(1 + philox(1, {i, 0, 0, 0})[0] % 0x7f7fffffu));
}

TEST(SourceQuantization, IsIdempotent) {
  std::vector<Source> once = many(5000);
  // Directions with two encodings, and the limits of all ranges.
  once[0].mirror = once[0].normal = normalize(Vec3f(1, 0, -1));
  once[1].mirror = once[1].normal = normalize(Vec3f(0, -1, -3));
  once[2].mirror = once[2].normal = Vec3f(0, 0, -1);
  once[3].delay_s = 86400;
  once[4].position_m = {1.9e6f, -1.9e6f, 1e5f};
  once[5].power = same_in_all_bands(1e24f);
  once[6].power = same_in_all_bands(3e-24f);
  once[7].power = {};
  once[8].patch_radius_m = 1e6f;
  once[9].patch_radius_m = 1e-9f;
  quantize_sources(once, {});
  std::vector<Source> twice = once;
  quantize_sources(twice, {});
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_EQ(once[i].position_m, twice[i].position_m) << i;
    EXPECT_EQ(once[i].normal, twice[i].normal) << i;
    EXPECT_EQ(once[i].mirror, twice[i].mirror) << i;
    EXPECT_EQ(once[i].delay_s, twice[i].delay_s) << i;
    EXPECT_EQ(once[i].power, twice[i].power) << i;
    EXPECT_EQ(once[i].patch_radius_m, twice[i].patch_radius_m) << i;
    EXPECT_EQ(once[i].u, twice[i].u) << i;
    EXPECT_EQ(once[i].polarity, twice[i].polarity) << i;
  }
}

// The slow version: powers are rounded up or down, and then all values twice to nearest.
TEST(SourceQuantization, GivesWhatItsStepsGive) {
  std::vector<Source> sources = many(5000);
  for (std::uint32_t i = 0; i < 1000; ++i)  // around the steps of the radius, and powers rounded
    sources[i].patch_radius_m = static_cast<float>(std::pow(10, (i % 511 - 199.5) / 40));
  quantize_sources(std::span(sources).subspan(500, 100), {});
  sources[1000].mirror = sources[1000].normal = normalize(Vec3f(1, 0, -1));
  sources[1001].delay_s = 86400;
  sources[1002].position_m = {1.9e6f, -1.9e6f, 1e5f};
  sources[1003].power = {1e30f, 1e24f, 3e-24f, 4e-25f, 1e-40f, 0, 1, 2};
  sources[1004].patch_radius_m = 1e30f;
  for (Source& source : sources) {
    Source expected = source;
    round_powers_stochastically(expected);
    for (int pass = 0; pass < 2; ++pass)
      expected = dequantized(quantized(expected, kMinMirrorBits), kMinMirrorBits);
    quantize_sources(std::span(&source, 1), {});
    EXPECT_EQ(source.position_m, expected.position_m);
    EXPECT_EQ(source.normal, expected.normal);
    EXPECT_EQ(source.mirror, expected.mirror);
    EXPECT_EQ(source.delay_s, expected.delay_s);
    EXPECT_EQ(source.power, expected.power);
    EXPECT_EQ(source.patch_radius_m, expected.patch_radius_m);
    EXPECT_EQ(source.u, expected.u);
    EXPECT_EQ(source.polarity, expected.polarity);
  }
}

// Radii are rounded by a table; around each of its steps it has to round as the logarithm does.
TEST(SourceQuantization, RoundsPatchesToTheNearestHalfDecibelOfTheirArea) {
  for (int c = 0; c < kRadiusCodes; ++c) {
    const auto step = static_cast<float>(std::pow(10, (c + 0.5 - 200) / 40));
    for (std::int32_t ulp = -3; ulp <= 3; ++ulp) {
      Source source = anywhere(5);
      source.patch_radius_m = std::bit_cast<float>(std::bit_cast<std::int32_t>(step) + ulp);
      const double code =
          200 + 12.041199826559248 * log2_of(static_cast<double>(source.patch_radius_m));
      ASSERT_EQ(quantized(source, kMinMirrorBits).radius,
                std::clamp(std::round(code), 1.0, kRadiusCodes - 1.0))
          << source.patch_radius_m;
    }
  }
}

TEST(SourceQuantization, LeavesEmittersAlone) {
  Source emitter = anywhere(5);
  emitter.is_emitter = true;
  const Source before = emitter;
  quantize_sources(std::span(&emitter, 1), {});
  EXPECT_EQ(emitter.position_m, before.position_m);
  EXPECT_EQ(emitter.u, before.u);
}

// Regular sources: grid points on a wall with equal delays.
TEST(SourceHash, IsUniformAndUncorrelatedEvenOnAGrid) {
  constexpr int kEdge = 400, kBins = 64, kAll = kEdge * kEdge;
  std::vector<double> u(kAll);
  std::vector<int> bins(kBins, 0);
  int positive = 0;
  for (int x = 0; x < kEdge; ++x)
    for (int z = 0; z < kEdge; ++z) {
      const std::uint32_t random = source_hash(x, 700, z, 4800, 3, 127u | 90u << 16);
      const double value = static_cast<double>(u_from_hash(random));
      ASSERT_GT(value, 0);
      ASSERT_LE(value, 1);
      u[static_cast<std::size_t>(x * kEdge + z)] = value;
      ++bins[static_cast<std::size_t>(std::min(kBins - 1, static_cast<int>(value * kBins)))];
      positive += polarity_from_hash(random) > 0 ? 1 : 0;
    }
  double chi2 = 0;
  for (const int count : bins)
    chi2 += std::pow(count - kAll / double{kBins}, 2) / (kAll / double{kBins});
  EXPECT_LT(std::abs(chi2 - 63), 4 * std::sqrt(2 * 63.0));
  EXPECT_LT(std::abs(positive - kAll / 2), 4 * std::sqrt(kAll) / 2);
  for (const int step : {1, 2, 7, 16, kEdge, kEdge + 1, 16 * kEdge}) {
    double sum = 0;
    for (std::size_t i = 0; i + static_cast<std::size_t>(step) < u.size(); ++i)
      sum += 12 * (u[i] - 0.5) * (u[i + static_cast<std::size_t>(step)] - 0.5);
    EXPECT_LT(std::abs(sum), 4 * std::sqrt(kAll)) << step;
  }
}

// Every bit of every input changes the hash.
TEST(SourceHash, ChangesWithEveryBitOfItsInput) {
  for (std::uint32_t round = 0; round < 50; ++round) {
    const RandomBits a = philox(31, {round, 0, 0, 0}), b = philox(31, {round, 1, 0, 0});
    const auto of = [&](int word, int bit) {
      std::array<std::uint32_t, 6> w = {a[0] % 4096,   a[1] % 4096, a[2] % 4096,
                                        a[3] % 200000, b[0] % 9,    b[1] & 0xff00ffu};
      if (word >= 0) w[static_cast<std::size_t>(word)] ^= 1u << bit;
      return source_hash(static_cast<std::int32_t>(w[0]), static_cast<std::int32_t>(w[1]),
                         static_cast<std::int32_t>(w[2]), w[3], w[4], w[5]);
    };
    const std::uint32_t plain = of(-1, 0);
    int flipped = 0;
    for (int word = 0; word < 6; ++word)
      for (int bit = 0; bit < 32; ++bit) {
        EXPECT_NE(of(word, bit), plain) << word << ' ' << bit;
        flipped += std::popcount(of(word, bit) ^ plain);
      }
    // 16 of 32 bits on average over 192 changes; standard error sqrt(8 / 192) = 0.2.
    EXPECT_NEAR(flipped / 192.0, 16, 1.2);
  }
}

}  // namespace
}  // namespace clamor
