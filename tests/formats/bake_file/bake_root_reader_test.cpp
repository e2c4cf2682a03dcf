#include "formats/bake_file/bake_root_reader.h"

#include <functional>

#include "common/random.h"
#include "tests/formats/forged_root.h"
#include "tests/sanitized.h"

namespace clamor::testing {
namespace {

// Modifications with valid checksums.
struct Hostile {
  const char* what;
  std::function<void(BakeRoot::Builder)> change;
};

std::function<void(BakeRoot::Builder)> geometry_page(
    const std::function<void(::GeometryPage::Builder)>& change) {
  return [=](BakeRoot::Builder root) { change(root.getGeometry().getPages()[0]); };
}

std::vector<Hostile> hostile_roots() {
  using Root = BakeRoot::Builder;
  constexpr std::uint64_t kHuge = 1ull << 63;
  return {
      {"page beyond the file", top_with<std::uint64_t>(kOffsetAt, kHuge)},
      {"page before the file", top_with<std::uint64_t>(kOffsetAt, 0)},
      {"page over the signals", top_with<std::uint32_t>(kPackedAt, 2000)},
      {"page of 4 GB", top_with<std::uint32_t>(kPackedAt, 0xffffffffu)},
      {"page of nothing", top_with<std::uint32_t>(kPackedAt, 0)},
      {"page whose end wraps round", top_with<std::uint64_t>(kOffsetAt, ~std::uint64_t{0} - 3)},
      {"page with no sources", top_with<std::uint32_t>(kSourcesAt, 0)},
      {"page with 2^31 sources", top_with<std::uint32_t>(kSourcesAt, 1u << 31)},
      {"page with one source more than it has", top_with<std::uint32_t>(kSourcesAt, 61)},
      {"page with a wrong checksum", top_with<std::uint64_t>(kHashAt, 7)},
      {"more sources below than there are", top_with<std::uint64_t>(kBelowAt, 102)},
      {"sources below without end", top_with<std::uint64_t>(kBelowAt, kHuge)},
      {"two children where there is one", top_with<std::uint8_t>(kChildrenAt, 2)},
      {"255 children", top_with<std::uint8_t>(kChildrenAt, 255)},
      {"a copy of no tree", top_with<std::uint16_t>(kInstancesAt, 1)},
      {"65535 copies", top_with<std::uint16_t>(kInstancesAt, 65535)},
      {"a ninth octant", top_with<std::uint8_t>(kOctantAt, 8)},
      {"box inside out", top_with<float>(0, 1000)},
      {"box that is no number", top_with<float>(12, kNaN)},
      {"box without end", top_with<float>(12, INFINITY)},
      {"key that is no number", top_with<float>(24, kNaN)},
      {"power that is no number", top_with<float>(40, kNaN)},
      {"cone that is no number", top_with<float>(64, kNaN)},
      {"delay that is no number", top_with<float>(76, kNaN)},
      {"top of a tree cut short", [](Root r) { r.getTrees()[0].initTop(119); }},
      {"tree without levels", [](Root r) { r.getTrees()[0].initLevels(0); }},
      {"levels without powers", [](Root r) { r.getTrees()[0].getLevels()[0].initPower(7); }},
      {"level of 2^63 nodes", [](Root r) { r.getTrees()[0].getLevels()[1].setNodes(kHuge); }},
      {"level of 2^63 bytes", [](Root r) { r.getTrees()[0].getLevels()[1].setPackedBytes(kHuge); }},
      {"too many trees", [](Root r) { r.initTrees(65537); }},
      {"signal map of other signals", [](Root r) { r.initSignalMaps(1).init(0, 2); }},
      {"signal map to what is not there", [](Root r) { r.initSignalMaps(1).init(0, 1).set(0, 1); }},
      {"bands missing", [](Root r) { r.initBandsHz(7); }},
      {"other bands", [](Root r) { r.getBandsHz().set(0, 31.5f); }},
      {"power of seven bands", [](Root r) { r.initPowerEmitted(7); }},
      {"negative power", [](Root r) { r.getPowerEscaped().set(0, -1); }},
      {"material that absorbs 200 %",
       [](Root r) { r.getMaterials()[0].getAbsorption().set(0, 2); }},
      {"material that absorbs no number",
       [](Root r) { r.getMaterials()[0].getAbsorption().set(0, kNaN); }},
      {"material with an exponent of 10^9",
       [](Root r) { r.getMaterials()[1].getPhong().set(7, 1e9f); }},
      {"material without bands", [](Root r) { r.getMaterials()[1].initScattering(0); }},
      {"no materials for the triangles", [](Root r) { r.initMaterials(0); }},
      {"too many movable parts", [](Root r) { r.initMovables(4097); }},
      {"movable part of nothing", [](Root r) { r.initMovables(1); }},
      {"movable part at no number", [](Root r) { r.getMovables()[0].setX(kNaN); }},
      {"movable part beyond the world", [](Root r) { r.getMovables()[0].setZ(1e30); }},
      {"movable part without a rotation",
       [](Root r) {
         r.getMovables()[0].setRotationW(0);
         r.getMovables()[0].setRotationY(0);
       }},
      {"movable part scaled to nothing", [](Root r) { r.getMovables()[0].setScale(0); }},
      {"movable part of a vertex that is no number",
       [](Root r) { r.getMovables()[0].getVertices().set(4, kNaN); }},
      {"movable part of a vertex that is not there",
       [](Root r) { r.getMovables()[0].getTriangles().set(5, 8); }},
      {"movable part of a material that is not there",
       [](Root r) { r.getMovables()[0].getMaterials().set(11, 2); }},
      {"movable part of half a vertex", [](Root r) { r.getMovables()[0].initVertices(23); }},
      {"movable part of half a triangle", [](Root r) { r.getMovables()[0].initTriangles(35); }},
      {"movable part without materials", [](Root r) { r.getMovables()[0].initMaterials(0); }},
      {"movable part of many vertices and few triangles",
       [](Root r) { r.getMovables()[0].initVertices(300); }},
      {"emitter of a signal that is not there", [](Root r) { r.getEmitters()[0].setSignal(1); }},
      {"emitter nowhere", [](Root r) { r.getEmitters()[0].setX(kNaN); }},
      {"emitter with a long axis", [](Root r) { r.getEmitters()[0].setAxisX(5); }},
      {"emitter of infinite gain", [](Root r) { r.getEmitters()[0].setGain(INFINITY); }},
      {"emitter that starts in a thousand years",
       [](Root r) { r.getEmitters()[0].setDelayS(3e10); }},
      {"no emitters for the sources", [](Root r) { r.initEmitters(0); }},
      {"signal of 2^63 frames", [](Root r) { r.getSignals()[0].setFrames(kHuge); }},
      {"signal of no frames", [](Root r) { r.getSignals()[0].setFrames(0); }},
      {"signal longer than it is", [](Root r) { r.getSignals()[0].setFrames(301); }},
      {"signal beyond the file", [](Root r) { r.getSignals()[0].getBlockOffset().set(0, kHuge); }},
      {"signal over the pages", [](Root r) { r.getSignals()[0].getBlockOffset().set(0, 64); }},
      {"signal in no block", [](Root r) { r.getSignals()[0].initBlockOffset(0); }},
      {"signal in more blocks than it is long",
       [](Root r) {
         auto signal = r.getSignals()[0];
         for (auto* list : {"offset", "hash"}) {
           auto two = list[0] == 'o' ? signal.initBlockOffset(2) : signal.initBlockHash(2);
           two.set(0, 1000);
           two.set(1, 1000);
         }
         signal.initBlockBytes(2);
       }},
      {"signal with blocks of no bytes", [](Root r) { r.getSignals()[0].initBlockBytes(0); }},
      {"envelope beyond the file", [](Root r) { r.getSignals()[0].setEnvelopeOffset(kHuge); }},
      {"envelope over its signal",
       [](Root r) {
         auto signal = r.getSignals()[0];
         signal.setEnvelopeOffset(signal.getBlockOffset()[0]);
       }},
      {"envelope that is no zstd frame",
       [](Root r) {
         auto signal = r.getSignals()[0];
         signal.setEnvelopeBytes(0);
         signal.setEnvelopeHash(hash_of({}));
       }},
      {"envelope of seven bands", [](Root r) { r.getSignals()[0].initMeanSquare(7); }},
      {"envelope that is no number",
       [](Root r) { r.getSignals()[0].getMeanSquare().set(4, kNaN); }},
      {"envelope of a band that is silent",
       [](Root r) { r.getSignals()[0].getMeanSquare().set(3, 0); }},
      {"envelope of an infinite band",
       [](Root r) { r.getSignals()[0].getMeanSquare().set(3, INFINITY); }},
      {"signal of no scale", [](Root r) { r.getSignals()[0].setScale(kNaN); }},
      {"signal that is no FLAC",
       [](Root r) {
         auto signal = r.getSignals()[0];
         signal.getBlockBytes().set(0, 0);
         signal.getBlockHash().set(0, hash_of({}));
       }},
      {"silence of half an hour in a few bytes",
       [](Root r) { r.getSignals()[0].setFrames(kSampleRate_hz * 1800); }},
      {"too many signals",
       [](Root r) {
         const Bytes name(8, 'x');
         auto one = r.getSignals()[0];
         const auto end = one.getEnvelopeOffset() + one.getEnvelopeBytes();
         auto many = r.initSignals(65537);
         for (auto signal : many) {
           signal.setScale(1);
           signal.setFrames(1);
           signal.initBlockOffset(1).set(0, end - 1);
           signal.initBlockBytes(1).set(0, 1);
           signal.initBlockHash(1);
           signal.initMeanSquare(8);
           signal.setEnvelopeOffset(end);
         }
       }},
      {"decay times of seven bands", [](Root r) { r.initDecayT30S(7); }},
      {"decay time that is no number", [](Root r) { r.getDecayT30S().set(2, kNaN); }},
      {"negative error of a decay", [](Root r) { r.getDecayT30ErrorS().set(2, -1); }},
      {"infinite error of the decays", [](Root r) { r.setDecayErrorDb(INFINITY); }},
      {"geometry in two ways", [](Root r) { r.getGeometry().setTriangles(2); }},
      {"geometry of vertices alone", [](Root r) { r.getGeometry().setVertices(3); }},
      {"geometry of bytes alone", [](Root r) { r.getGeometry().setBytes(1); }},
      {"geometry of 2^32 triangles", geometry_page([](auto p) { p.setTriangles(0xffffffffu); })},
      {"geometry of 2^32 vertices", geometry_page([](auto p) { p.setVertices(0xffffffffu); })},
      {"geometry of no triangle", geometry_page([](auto p) { p.setTriangles(0); })},
      {"geometry of one triangle more", geometry_page([](auto p) { p.setTriangles(3); })},
      {"geometry of fewer vertices", geometry_page([](auto p) { p.setVertices(3); })},
      {"geometry of 4 GB", geometry_page([](auto p) { p.setBytes(0xffffffffu); })},
      {"geometry of nothing", geometry_page([](auto p) { p.setBytes(0); })},
      {"geometry beyond the file", geometry_page([](auto p) { p.setOffset(1ull << 63); })},
      {"geometry page over the signals", geometry_page([](auto p) { p.setOffset(64); })},
      {"geometry with a wrong checksum", geometry_page([](auto p) { p.setHash(7); })},
      {"geometry that is there twice",
       [](Root r) {
         const auto one = r.getGeometry().getPages()[0];
         auto orphan = r.getGeometry().disownPages();
         auto two = r.getGeometry().initPages(2);
         two.setWithCaveats(0, one);
         two.setWithCaveats(1, one);
       }},
      {"geometry nowhere", [](Root r) { r.getGeometry().setLowZ(kNaN); }},
      {"geometry over the signals", [](Root r) { r.getGeometry().setOffset(64); }},
      {"air at absolute zero", [](Root r) { r.setTemperatureC(-300); }},
      {"air without pressure", [](Root r) { r.setPressureKpa(0); }},
      {"kappa that is no number", [](Root r) { r.setRouletteKappa(kNaN); }},
  };
}

TEST(HostileBakeFile, WithInvalidValuesAndValidChecksumsIsRejected) {
  const Bytes whole = written(contents());
  ASSERT_TRUE(read_whole(with_root(whole, [](BakeRoot::Builder) {})).ok());
  for (const Hostile& hostile : hostile_roots())
    EXPECT_FALSE(read_whole(with_root(whole, hostile.change)).ok()) << hostile.what;
}

// Files of older versions may hold materials that transmit more than they absorb.
TEST(BakeFile, IsReadWithMaterialsThatTransmitAtMostWhatTheyAbsorb) {
  const std::string path = path_of("transmission.clamor");
  std::ofstream(path, std::ios::binary)
      << with_root(written(contents()), [](BakeRoot::Builder root) {
           root.getMaterials()[0].getAbsorption().set(2, 0.25f);
           root.getMaterials()[0].getTransmission().set(2, 0.5f);
         });
  const auto file = BakeFile::open(path, FileAccess::kRead);
  std::filesystem::remove(path);
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->materials()[0].transmission[2], 0.25f);
}

// Lists of materials have another layout if one of them has rows of seats.
TEST(BakeFile, KeepsTheDepthOfRowsOfSeats) {
  BakeContents bake = contents();
  const Bytes without = written(bake);
  bake.materials[1].rows_m = 0.75f;
  const std::string path = path_of("rows.clamor");
  std::ofstream(path, std::ios::binary) << written(bake);
  const auto file = BakeFile::open(path, FileAccess::kRead);
  std::filesystem::remove(path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(file->materials(), bake.materials);
  EXPECT_FALSE(read_whole(with_root(written(bake), [](BakeRoot::Builder root) {
                 root.getMaterials()[1].setRowsM(-1);
               })).ok());
  bake.materials[1].rows_m = 0;
  EXPECT_EQ(written(bake), without);
}

TEST(HostileBakeFile, WithARandomRootIsRejected) {
  const Bytes whole = written(contents());
  Preamble preamble;
  std::memcpy(&preamble, whole.data(), sizeof(preamble));
  constexpr std::uint32_t kFiles = testing::kSanitized ? 1'000 : 2'000;
  for (std::uint32_t round = 0; round < kFiles; ++round) {
    Bytes bytes = whole;
    const RandomBits size = philox(5, {round, 0, 1, 0});
    bytes.resize(preamble.root_offset + 8 * (size[0] % 64));
    for (std::size_t i = preamble.root_offset; i < bytes.size(); ++i)
      bytes[i] = static_cast<char>(philox(5, {round, static_cast<std::uint32_t>(i), 0, 0})[0] &
                                   (size[1] & 1 ? 0xff : 3));
    seal(bytes);
    ASSERT_FALSE(read_whole(bytes).ok()) << "round " << round;
  }
}

TEST(HostileBakeFile, WithRandomChangesOfItsRootNeverCrashes) {
  const Bytes whole = written(contents());
  Preamble preamble;
  std::memcpy(&preamble, whole.data(), sizeof(preamble));
  const std::size_t root_bytes = whole.size() - preamble.root_offset;
  constexpr std::uint32_t kFiles = testing::kSanitized ? 2'000 : 5'000;
  std::uint32_t refused = 0;
  for (std::uint32_t round = 0; round < kFiles; ++round) {
    Bytes bytes = whole;
    const RandomBits bits = philox(6, {round, 0, 0, 0});
    for (std::uint32_t k = 0; k <= bits[0] % 3; ++k) {
      const RandomBits where = philox(6, {round, 1, k, 0});
      bytes[preamble.root_offset + where[0] % root_bytes] = static_cast<char>(where[1]);
    }
    seal(bytes);
    refused += !read_whole(bytes).ok();
  }
  EXPECT_GT(refused, kFiles / 10);  // names and powers may have any value
}

}  // namespace
}  // namespace clamor::testing
