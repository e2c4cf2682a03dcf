#include "formats/bake_file/page.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "common/material.h"
#include "common/random.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/source_quantization.h"
#include "formats/level/emitter.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using Bytes = std::vector<std::byte>;

constexpr std::size_t kMaterials = 3;

std::vector<Emitter> emitters(std::size_t count = 40) {
  std::vector<Emitter> all(count);
  for (std::size_t i = 0; i < count; ++i) {
    all[i].name = "e";
    all[i].position_m = Vec3(1 + 0.1 * static_cast<double>(i), 2, 3);
    all[i].gain = 1 + static_cast<double>(i);
  }
  return all;
}

// A node and its sources.
struct MadePage {
  OctreeNode node;
  std::vector<Source> sources;
  int mirror_bits = kMinMirrorBits;

  Bytes encoded() const { return encode_page(node, sources, mirror_bits); }
};

Vec3f any_direction(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const RandomBits bits = philox(5, {a, b, c, 0});
  return Vec3f(normalize(Vec3(unit(bits[0]) - 0.5, unit(bits[1]) - 0.5, unit(bits[2]) - 0.5)));
}

struct Mix {
  std::size_t count = 200;
  std::uint32_t planes = 6;  // number of planes; 0: one per source
  double edge_m = 10;        // of the box
  double far_m = 0;          // of the box from the origin
  std::uint32_t emitter_rows = 1;
  bool by_key = true, quantised = true, silent_bands = false, wild = false;
};

MadePage made(std::uint32_t seed, const Mix& mix) {
  MadePage page;
  const auto table = emitters();
  for (std::uint32_t i = 0; i < mix.count; ++i) {
    const RandomBits a = philox(6, {seed, i, 0, 0}), b = philox(6, {seed, i, 1, 0});
    Source source;
    source.u = static_cast<float>(unit_above_zero(b[0]));
    source.emitter = b[1] % static_cast<std::uint32_t>(table.size());
    if (i < mix.emitter_rows) {
      set_from_emitter(source, table[source.emitter]);
      page.sources.push_back(source);
      continue;
    }
    const std::uint32_t plane = mix.planes == 0 ? 1000 + i : a[3] % mix.planes;
    const Vec3 normal = plane % 2 == 0 ? Vec3(plane % 3 == 0, plane % 3 == 1, plane % 3 == 2)
                                       : Vec3(any_direction(seed, plane, 7));
    Vec3 place = Vec3(unit(a[0]), unit(a[1]), unit(a[2])) * mix.edge_m;
    place -= normal * dot(normal, place - Vec3(mix.edge_m / 2));
    source.position_m = Vec3f(place + Vec3(mix.far_m));
    source.normal = Vec3f(normal);
    source.mirror = any_direction(seed, i, 8);
    source.delay_s = static_cast<float>(unit(b[2]) * (mix.wild ? 86400 : 2));
    const double loss = unit(b[3]);
    for (std::size_t k = 0; k < kBandCount; ++k) {
      source.power[k] = static_cast<float>(
          std::pow(10, -(mix.wild ? 40 : 5) * unit(a[3]) * (1 + loss * static_cast<double>(k))));
      if (mix.silent_bands && (b[3] >> k & 1) != 0) source.power[k] = 0;
    }
    source.patch_radius_m = i % 17 == 0 ? 0 : static_cast<float>(0.01 + unit(b[1]));
    source.material = static_cast<std::uint16_t>(plane % kMaterials);
    source.polarity = (b[2] & 1) != 0 ? 1 : -1;
    page.sources.push_back(source);
  }
  if (mix.quantised) quantize_sources(page.sources, {});
  if (mix.by_key)
    std::stable_sort(
        page.sources.begin(), page.sources.end(),
        [](const Source& x, const Source& y) { return octree_key(x) > octree_key(y); });
  page.node.low_m = Vec3f(1e30f);
  page.node.high_m = Vec3f(-1e30f);
  for (const Source& source : page.sources) {
    page.node.low_m = glm::min(page.node.low_m, source.position_m);
    page.node.high_m = glm::max(page.node.high_m, source.position_m);
  }
  page.node.source_count = static_cast<std::uint32_t>(page.sources.size());
  return page;
}

void expect_same(const Source& a, const Source& b) {
  EXPECT_EQ(a.position_m, b.position_m);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.mirror, b.mirror);
  EXPECT_EQ(a.delay_s, b.delay_s);
  EXPECT_EQ(a.power, b.power);
  EXPECT_EQ(a.patch_radius_m, b.patch_radius_m);
  EXPECT_EQ(a.u, b.u);
  EXPECT_EQ(a.emitter, b.emitter);
  EXPECT_EQ(a.material, b.material);
  EXPECT_EQ(a.polarity, b.polarity);
  EXPECT_EQ(a.is_emitter, b.is_emitter);
}

// Invariants of any page that was accepted.
void expect_harmless(const MadePage& page, const PageColumns& columns) {
  ASSERT_EQ(columns.count, page.node.source_count);
  for (std::size_t i = 0; i < columns.count; ++i) {
    const Source source = columns.source(i);
    ASSERT_LT(source.emitter, emitters().size());
    ASSERT_TRUE(source.u > 0 && source.u <= 1);
    ASSERT_TRUE(source.polarity == 1 || source.polarity == -1);
    ASSERT_NEAR(length(source.normal), 1, 1e-5);
    ASSERT_NEAR(length(source.mirror), 1, 1e-5);
    for (const float power : source.power) ASSERT_TRUE(power >= 0 && power <= 1.001e24f);
    ASSERT_TRUE(source.delay_s >= 0 && source.delay_s <= 90000);
    ASSERT_TRUE(source.patch_radius_m >= 0 && source.patch_radius_m < 1e8f);
    if (source.is_emitter) continue;
    ASSERT_LT(source.material, kMaterials);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_GE(source.position_m[axis], page.node.low_m[axis] - 1.0f / kPositionSteps_per_m);
      ASSERT_LE(source.position_m[axis], page.node.high_m[axis] + 1.0f / kPositionSteps_per_m);
    }
  }
}

class PageTest : public ::testing::Test {
 protected:
  // Returns whether the page is refused. Accepted pages must satisfy the invariants.
  bool refuses(const MadePage& page, const Bytes& bytes) {
    const auto done = decoder_.decode_unpacked(page.node, bytes, table_, kMaterials, *columns_);
    if (done.ok())
      expect_harmless(page, *columns_);
    else
      EXPECT_EQ(columns_->count, 0u);
    return !done.ok();
  }

  std::vector<Source> decoded(const MadePage& page) {
    const Bytes frame = zstd_compress_fast(page.encoded());
    const auto done = decoder_.decode(page.node, frame, table_, kMaterials, *columns_);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
    return sources_of(*columns_);
  }

  std::vector<Emitter> table_ = emitters();
  PageDecoder decoder_;
  std::unique_ptr<PageColumns> columns_ = std::make_unique<PageColumns>();
};

TEST_F(PageTest, RoundTripsQuantizedSourcesExactly) {
  std::uint32_t seed = 0;
  for (const std::size_t count : {1, 2, 3, 4, 5, 7, 8, 9, 64, 200, 511, 512})
    for (const std::uint32_t planes : {0u, 1u, 6u, 40u})
      for (const bool by_key : {true, false})
        for (const std::uint32_t emitter_rows : {0u, 1u, 5u}) {
          ++seed;
          const MadePage page = made(seed, {.count = count,
                                            .planes = planes,
                                            .edge_m = seed % 2 == 0 ? 10.0 : 300.0,
                                            .far_m = seed % 5 == 0 ? 5e5 : -40,
                                            .emitter_rows = emitter_rows,
                                            .by_key = by_key,
                                            .silent_bands = seed % 3 == 0,
                                            .wild = seed % 7 == 0});
          const auto after = decoded(page);
          ASSERT_EQ(after.size(), page.sources.size());
          for (std::size_t i = 0; i < after.size(); ++i) {
            SCOPED_TRACE("page " + std::to_string(seed) + ", source " + std::to_string(i));
            expect_same(after[i], page.sources[i]);
          }
        }
}

TEST_F(PageTest, KeepsOrderUAndPolarityOfOtherSources) {
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    const MadePage page = made(seed, {.by_key = false, .quantised = false});
    const auto after = decoded(page);
    ASSERT_EQ(after.size(), page.sources.size());
    for (std::size_t i = 0; i < after.size(); ++i) {
      EXPECT_EQ(after[i].u, page.sources[i].u);
      EXPECT_EQ(after[i].polarity, page.sources[i].polarity);
      EXPECT_EQ(after[i].emitter, page.sources[i].emitter);
      EXPECT_LE(length(after[i].position_m - page.sources[i].position_m), 3.4e-3f);
      EXPECT_NEAR(after[i].delay_s, page.sources[i].delay_s, 0.51 / kSampleRate_hz);
    }
  }
}

TEST_F(PageTest, StoresUPolarityAndOrderOnlyIfTheyCannotBeDerived) {
  const Mix mix{.count = 512, .emitter_rows = 0};
  const MadePage page = made(1, mix);
  MadePage other_numbers = page, other_order = page, other_signs = page;
  for (std::size_t i = 0; i < page.sources.size(); ++i) {
    other_numbers.sources[i].u *= 0.999f;
    other_signs.sources[i].polarity = static_cast<std::int8_t>(i % 2 == 0 ? 1 : -1);
  }
  std::reverse(other_order.sources.begin(), other_order.sources.end());
  const auto bits = static_cast<double>(8 * page.encoded().size());
  const auto more = [&](const MadePage& other) {
    return (8 * static_cast<double>(other.encoded().size()) - bits) / 512;
  };
  EXPECT_NEAR(more(other_order), 9, 0.2);  // 9 bits for one of 512 positions
  EXPECT_NEAR(more(other_signs), 1, 0.2);
  EXPECT_GT(more(other_numbers), 20);
}

TEST_F(PageTest, SortsLikeTheOctreeEvenWithEqualKeys) {
  MadePage page = made(3, {.count = 300, .emitter_rows = 0});
  for (std::size_t i = 0; i < page.sources.size(); ++i) page.sources[i] = page.sources[i / 50 * 50];
  const auto after = decoded(page);
  for (std::size_t i = 0; i < after.size(); ++i) expect_same(after[i], page.sources[i]);
}

TEST_F(PageTest, WithAnyFlippedBitIsRejectedOrValid) {
  constexpr std::size_t kStep = testing::kSanitized ? 5 : 1;  // which meets each bit of a byte
  for (const Mix& mix : {Mix{.count = 60}, Mix{.count = 40, .planes = 0, .by_key = false},
                         Mix{.count = 30, .quantised = false, .silent_bands = true}}) {
    const MadePage page = made(9, mix);
    const Bytes bytes = page.encoded();
    std::size_t refused = 0;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += kStep) {
      Bytes flipped = bytes;
      flipped[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
      refused += refuses(page, flipped) ? 1 : 0;
    }
    EXPECT_GT(refused, bytes.size() / 2 / kStep);
  }
}

TEST_F(PageTest, TruncatedAnywhereIsRejected) {
  const MadePage page = made(10, {.count = 100});
  const Bytes bytes = page.encoded(), frame = zstd_compress_fast(bytes);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_TRUE(refuses(page, {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}))
        << size;
  for (std::size_t size = 0; size < frame.size(); ++size)
    EXPECT_FALSE(
        decoder_.decode(page.node, std::span(frame).first(size), table_, kMaterials, *columns_)
            .ok())
        << size;
}

TEST_F(PageTest, WithTrailingBytesIsRejected) {
  const MadePage page = made(11, {.count = 100});
  for (const std::size_t more : {1, 2, 100, 100'000}) {
    Bytes bytes = page.encoded();
    bytes.resize(bytes.size() + more);
    EXPECT_TRUE(refuses(page, bytes));
    const Bytes frame = packed(bytes);
    EXPECT_FALSE(decoder_.decode(page.node, frame, table_, kMaterials, *columns_).ok());
  }
}

TEST_F(PageTest, OfRandomBitsIsRejectedOrValid) {
  MadePage page = made(12, {.count = 20});
  const Bytes whole = page.encoded();
  std::size_t refused = 0;
  constexpr std::uint32_t kPages = testing::kSanitized ? 5'000 : 20'000;
  for (std::uint32_t round = 0; round < kPages; ++round) {
    const RandomBits shape = philox(13, {round, 0, 0, 0});
    Bytes bytes = whole;
    bytes.resize(shape[0] % (2 * whole.size()));
    // Keeps the header, which would otherwise reject most pages.
    for (std::size_t i = shape[1] % 60 + 7; i < bytes.size(); ++i)
      bytes[i] =
          static_cast<std::byte>(philox(13, {round, 1, static_cast<std::uint32_t>(i), 0})[0] &
                                 (round % 2 == 0 ? 255 : 17));
    refused += refuses(page, bytes) ? 1 : 0;
  }
  EXPECT_GT(refused, kPages * 3 / 4);
}

TEST_F(PageTest, IsValidatedAgainstTheTablesAndTheNode) {
  const MadePage page = made(14, {.count = 100});
  const Bytes bytes = page.encoded();
  ASSERT_FALSE(refuses(page, bytes));
  const auto refused = [&](const OctreeNode& node, std::span<const Emitter> table,
                           std::size_t materials) {
    return !decoder_.decode_unpacked(node, bytes, table, materials, *columns_).ok();
  };
  EXPECT_TRUE(refused(page.node, std::span(table_).first(39), kMaterials));
  EXPECT_TRUE(refused(page.node, {}, kMaterials));
  EXPECT_TRUE(refused(page.node, table_, kMaterials - 1));
  EXPECT_TRUE(refused(page.node, table_, 0));
  OctreeNode node = page.node;
  node.source_count = 99;
  EXPECT_TRUE(refused(node, table_, kMaterials));
  node.source_count = 101;
  EXPECT_TRUE(refused(node, table_, kMaterials));
  node.source_count = 0xffffffff;
  EXPECT_TRUE(refused(node, table_, kMaterials));
  node = page.node;
  node.high_m.x = (node.low_m.x + node.high_m.x) / 2;
  EXPECT_TRUE(refused(node, table_, kMaterials));
}

TEST_F(PageTest, NeverExceedsTheMaximumSize) {
  for (const std::size_t count : {1, 2, 50, 512}) {
    const MadePage page = made(15, {.count = count,
                                    .planes = 0,
                                    .edge_m = 3e6,
                                    .emitter_rows = 0,
                                    .by_key = false,
                                    .quantised = false,
                                    .silent_bands = true,
                                    .wild = true});
    EXPECT_LT(page.encoded().size(), max_page_bytes(count)) << count;
  }
}

TEST_F(PageTest, IsAFunctionOfItsSourcesAlone) {
  const MadePage page = made(16, {.count = 512});
  EXPECT_EQ(page.encoded(), page.encoded());
  // Scratch data of an earlier page has no effect.
  const auto first = decoded(page);
  decoded(made(17, {.count = 300, .emitter_rows = 50}));
  Bytes broken = page.encoded();
  broken.resize(broken.size() / 2);
  EXPECT_TRUE(refuses(page, broken));
  const auto second = decoded(page);
  for (std::size_t i = 0; i < first.size(); ++i) expect_same(first[i], second[i]);
}

}  // namespace
}  // namespace clamor
