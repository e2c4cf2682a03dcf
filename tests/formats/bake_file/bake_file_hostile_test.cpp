// bake_file_hostile_test.cpp: files with invalid values and valid checksums, and the same checks in
// the writer.
#include <array>
#include <functional>

#include "formats/audio/audio_file.h"
#include "tests/formats/forged_root.h"
#include "tests/peak_memory.h"
#include "tests/sanitized.h"

namespace clamor::testing {
namespace {

// Modifications with valid checksums.
struct Hostile {
  const char* what;
  std::function<void(BakeRoot::Builder)> change;
};

// Offsets in an entry (bake_format.md).
constexpr std::size_t kSourcesAt = 84, kPackedAt = 88, kOctantAt = 92, kChildrenAt = 93,
                      kInstancesAt = 94, kBelowAt = 96, kOffsetAt = 104, kHashAt = 112;

template <class T>
void set_in(kj::ArrayPtr<kj::byte> bytes, std::size_t at, T value) {
  std::memcpy(bytes.begin() + at, &value, sizeof(T));
}

template <class T>
std::function<void(BakeRoot::Builder)> top_with(std::size_t at, T value) {
  return [=](BakeRoot::Builder root) { set_in(root.getTrees()[0].getTop(), at, value); };
}

// The page of the root of the only tree.
PageLink top_page(const Bytes& bytes) {
  PageLink page;
  with_root(bytes, [&page](BakeRoot::Builder root) {
    const auto top = root.getTrees()[0].getTop();
    page = read_entry(std::as_bytes(std::span(top.begin(), top.size())))->page;
  });
  return page;
}

// Returns the file with a modified entry in the page of the root, and valid checksums.
template <class T>
Bytes with_child(Bytes bytes, std::size_t at, T value) {
  const PageLink page = top_page(bytes);
  std::memcpy(bytes.data() + page.offset + page.packed_bytes + at, &value, sizeof(T));
  const auto changed = std::as_bytes(std::span(bytes)).subspan(page.offset, page.bytes());
  const std::uint64_t hash = hash_of(changed);
  return with_root(bytes, top_with(kHashAt, hash));
}

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

TEST(HostileBakeFile, WithRightChecksumsIsRefusedAllTheSame) {
  const Bytes whole = written(contents());
  ASSERT_TRUE(read_whole(with_root(whole, [](BakeRoot::Builder) {})).ok());
  for (const Hostile& hostile : hostile_roots())
    EXPECT_FALSE(read_whole(with_root(whole, hostile.change)).ok()) << hostile.what;
}

TEST(HostileBakeFile, WithAPageThatSpeaksOfWrongChildrenIsRefused) {
  const Bytes whole = written(contents());
  ASSERT_TRUE(read_whole(with_child<std::uint8_t>(whole, kOctantAt, 3)).ok());
  constexpr std::uint64_t kHuge = 1ull << 63;
  const auto refused = [&](const char* what, std::size_t at, auto value) {
    EXPECT_FALSE(read_whole(with_child(whole, at, value)).ok()) << what;
  };
  refused("child that is in the midst of another page", kOffsetAt, std::uint64_t{65});
  refused("child before the file", kOffsetAt, std::uint64_t{0});
  refused("child beyond the file", kOffsetAt, kHuge);
  refused("child whose end wraps round", kOffsetAt, ~std::uint64_t{0} - 3);
  refused("child of 4 GB", kPackedAt, 0xffffffffu);
  refused("child of nothing", kPackedAt, 0u);
  refused("child without sources", kSourcesAt, 0u);
  refused("child of 2^31 sources", kSourcesAt, 1u << 31);
  refused("child with children of its own", kChildrenAt, std::uint8_t{1});
  refused("child with copies", kInstancesAt, std::uint16_t{1});
  refused("child of more below than its parent has", kBelowAt, std::uint64_t{42});
  refused("child with a wrong checksum", kHashAt, std::uint64_t{7});
  refused("child beyond the eighth", kOctantAt, std::uint8_t{9});
  refused("child beyond its parent's box", 0, -1.0f);
  refused("child inside out", 0, 1000.0f);
  refused("child nowhere", 12, kNaN);
  refused("child of a higher key", 24, 2.0f);
  refused("child of infinite power", 28, INFINITY);
  refused("child of a cone that is no number", 72, kNaN);
  refused("child of a negative delay", 76, -1.0f);
}

TEST(HostileBakeFile, InWhichTwoNodesHaveOnePageIsRefused) {
  BakeContents bake = contents(99);
  OctreeNode& child = bake.octree.nodes[1];
  ASSERT_EQ(child.source_count, 40u);
  child.source_count = 20;
  OctreeNode other = child;
  other.first_source += 20;
  bake.octree.nodes[0].children[5] = 2;
  bake.octree.nodes.push_back(other);
  const Bytes whole = written(bake);
  ASSERT_TRUE(read_whole(whole).ok());
  // Copies one entry over the other, except for its octant.
  const PageLink page = top_page(whole);
  ASSERT_EQ(page.children, 2);
  std::array<char, kOctantAt> before{};
  std::array<char, kEntryBytes - kChildrenAt> after{};
  const char* const first = whole.data() + page.offset + page.packed_bytes;
  std::memcpy(before.data(), first, before.size());
  std::memcpy(after.data(), first + kChildrenAt, after.size());
  const Bytes shared =
      with_child(with_child(whole, kEntryBytes, before), kEntryBytes + kChildrenAt, after);
  const auto read = read_whole(shared);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("has two children on one page"), std::string::npos)
      << read.error().message;
}

// Moves the sections behind the block of the only signal by some bytes.
void move_what_follows(BakeRoot::Builder root, std::uint64_t added) {
  auto signal = root.getSignals()[0];
  signal.setEnvelopeOffset(signal.getEnvelopeOffset() + added);
  auto geometry = root.getGeometry();
  geometry.setOffset(geometry.getOffset() + added);
  for (auto page : geometry.getPages()) page.setOffset(page.getOffset() + added);
}

// Replaces bytes before the root by `put` and moves the root.
Bytes with_bytes(Bytes bytes, std::uint64_t offset, std::uint64_t count, const Bytes& put) {
  Preamble preamble;
  std::memcpy(&preamble, bytes.data(), sizeof(preamble));
  bytes.replace(offset, count, put);
  preamble.root_offset += put.size() - count;
  const std::uint64_t padding = -preamble.root_offset % 8;
  bytes.insert(preamble.root_offset, padding, '\0');
  preamble.root_offset += padding;
  std::memcpy(bytes.data(), &preamble, sizeof(preamble));
  seal(bytes);
  return bytes;
}

// Returns the file with another block for its only signal, and valid checksums.
Bytes with_signal_block(const Bytes& whole, const Bytes& block) {
  std::uint64_t offset = 0, before = 0;
  const Bytes bytes = with_root(whole, [&](BakeRoot::Builder root) {
    auto signal = root.getSignals()[0];
    offset = signal.getBlockOffset()[0];
    before = signal.getBlockBytes()[0];
    signal.getBlockBytes().set(0, static_cast<std::uint32_t>(block.size()));
    signal.getBlockHash().set(0, hash_of(std::as_bytes(std::span(block))));
    move_what_follows(root, block.size() - before);
  });
  return with_bytes(bytes, offset, before, block);
}

// Adds pages above those of a tree.
class Pages {
 public:
  explicit Pages(const PageEntry& top) : first_(top.page.end()) {}

  // A node without sources and with these children, with unlimited bounds.
  PageEntry above(std::vector<PageEntry> children) {
    PageEntry node = children.front();
    node.source_count = 0;
    node.sources_below = 0;
    node.octant = kNoOctant;
    node.page = {first_ + bytes_.size(), 0, 0, static_cast<std::uint8_t>(children.size()), 0};
    std::vector<std::byte> page;
    for (PageEntry& child : children) {
      child.octant = kNoOctant;
      put_entry(child, page);
      node.sources_below += child.sources_below;
    }
    node.page.hash = hash_of(page);
    bytes_.append(reinterpret_cast<const char*>(page.data()), page.size());
    return node;
  }

  std::uint64_t first() const { return first_; }
  const Bytes& bytes() const { return bytes_; }

 private:
  std::uint64_t first_;
  Bytes bytes_;
};

// Returns the file with pages added above its only tree; `build` returns the new root.
Bytes with_pages_above(const Bytes& whole,
                       const std::function<PageEntry(Pages&, const PageEntry& top)>& build) {
  PageEntry top;
  with_root(whole, [&](BakeRoot::Builder root) {
    const auto stored = root.getTrees()[0].getTop();
    top = *read_entry(std::as_bytes(std::span(stored.begin(), stored.size())));
  });
  Pages pages(top);
  const PageEntry new_top = build(pages, top);
  const Bytes bytes = with_root(whole, [&](BakeRoot::Builder root) {
    std::vector<std::byte> stored;
    put_entry(new_top, stored);
    const auto* const from = reinterpret_cast<const kj::byte*>(stored.data());
    root.getTrees()[0].setTop(kj::arrayPtr(from, stored.size()));
    auto offsets = root.getSignals()[0].getBlockOffset();
    offsets.set(0, offsets[0] + pages.bytes().size());
    move_what_follows(root, pages.bytes().size());
  });
  return with_bytes(bytes, pages.first(), 0, pages.bytes());
}

// A long chain of pages would have to be read one by one.
TEST(HostileBakeFile, WhoseTreeIsDeeperThanAnyTreeIsRefused) {
  const Bytes whole = written(contents());  // with two levels
  const auto with_levels_above = [&](std::size_t levels) {
    return with_pages_above(whole, [&](Pages& pages, PageEntry top) {
      for (std::size_t i = 0; i < levels; ++i) top = pages.above({top});
      return top;
    });
  };
  const auto deepest = read_whole(with_levels_above(kMaxTreeLevels - 2));
  EXPECT_TRUE(deepest.ok()) << deepest.error().message;
  const auto deeper = read_whole(with_levels_above(kMaxTreeLevels - 1));
  ASSERT_FALSE(deeper.ok());
  EXPECT_NE(deeper.error().message.find("deeper than 4096 levels"), std::string::npos)
      << deeper.error().message;
}

// Cousins that share a page: every level would double the number of paths to it.
TEST(HostileBakeFile, InWhichNodesOfDifferentParentsHaveOnePageIsRefused) {
  const Bytes whole = written(contents());
  const auto read = read_whole(with_pages_above(whole, [](Pages& pages, const PageEntry& top) {
    const PageEntry first = pages.above({top}), second = pages.above({top});
    return pages.above({first, second});
  }));
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("is another node's as well"), std::string::npos)
      << read.error().message;
}

TEST(HostileBakeFile, WhoseSignalIsLongerThanItSaysIsDecodedNoFurther) {
  const Bytes whole = written(contents());
  const auto flac_of = [](std::size_t frames) {
    const auto flac = encode_flac(std::vector<float>(frames, 0.0f));
    EXPECT_TRUE(flac.ok());
    return Bytes(reinterpret_cast<const char*>(flac->data()), flac->size());
  };
  const auto right = read_whole(with_signal_block(whole, flac_of(300)));
  ASSERT_TRUE(right.ok()) << right.error().message;
  const Bytes bomb = with_signal_block(whole, flac_of(std::size_t{kSampleRate_hz} * 300));
  const PeakMemory peak;
  const auto read = read_whole(bomb);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("has the wrong length"), std::string::npos)
      << read.error().message;
  if (peak.known() && !kSanitized) {
    EXPECT_LT(peak.more_bytes(), 20'000'000u);  // five minutes are 58 MB of samples
  }
}

TEST(HostileBakeFile, WhoseSignalIsAnySoundButFlacIsRefused) {
  const Bytes whole = written(contents());
  const std::string path = path_of("signal.wav");
  {
    auto wav = WavWriter::create(path, 1, kSampleRate_hz, SampleFormat::kPcm16);
    ASSERT_TRUE(wav.ok());
    ASSERT_TRUE(wav->write(std::vector<float>(300, 0.5f)).ok());
    ASSERT_TRUE(wav->finish().ok());
  }
  const auto read_wav = read_whole(with_signal_block(whole, read(path)));
  std::filesystem::remove(path);
  ASSERT_FALSE(read_wav.ok());
  EXPECT_NE(read_wav.error().message.find("is no FLAC stream"), std::string::npos)
      << read_wav.error().message;
}

TEST(HostileBakeFile, WithARootOfRandomWordsIsRefused) {
  const Bytes whole = written(contents());
  Preamble preamble;
  std::memcpy(&preamble, whole.data(), sizeof(preamble));
  for (std::uint32_t round = 0; round < 2000; ++round) {
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

TEST(HostileBakeFile, WithRandomWordsOfItsRootChangedNeverCrashes) {
  const Bytes whole = written(contents());
  Preamble preamble;
  std::memcpy(&preamble, whole.data(), sizeof(preamble));
  const std::size_t root_bytes = whole.size() - preamble.root_offset;
  int refused = 0;
  for (std::uint32_t round = 0; round < 5000; ++round) {
    Bytes bytes = whole;
    const RandomBits bits = philox(6, {round, 0, 0, 0});
    for (std::uint32_t k = 0; k <= bits[0] % 3; ++k) {
      const RandomBits where = philox(6, {round, 1, k, 0});
      bytes[preamble.root_offset + where[0] % root_bytes] = static_cast<char>(where[1]);
    }
    seal(bytes);
    refused += !read_whole(bytes).ok();
  }
  EXPECT_GT(refused, 500);  // names and powers may have any value
}

// Every field with every kind of invalid value.
TEST(BakeFile, IsReadBackWheneverItWasWritten) {
  using Change = std::function<void(BakeContents&, double)>;
  const auto as = [](auto& field, double x) { field = static_cast<float>(x); };
  const std::vector<Change> changes = {
      [](auto& c, double x) { c.emitters[0].gain = x; },
      [](auto& c, double x) { c.emitters[0].position_m.y = x; },
      [](auto& c, double x) { c.emitters[0].axis.z = x; },
      [](auto& c, double x) { c.emitters[0].delay_s = x; },
      [=](auto& c, double x) { as(c.emitters[0].directivity[3], x); },
      [](auto& c, double x) { c.emitters[0].signal = x > 0 && x < 9 ? 1 : 7; },
      [=](auto& c, double x) { as(c.materials[1].absorption[0], x); },
      [=](auto& c, double x) { as(c.materials[1].phong[7], x); },
      [](auto& c, double x) { c.settings.roulette_exponent = x; },
      [](auto& c, double x) { c.settings.air.humidity_percent = x; },
      [](auto& c, double x) { c.settings.air.pressure_kpa = x; },
      [](auto& c, double x) { c.statistics.mean_free_path_m = x; },
      [=](auto& c, double x) { as(c.statistics.power_emitted[1], x); },
      [=](auto& c, double x) { as(c.statistics.decay.t30_s[1], x); },
      [=](auto& c, double x) { as(c.statistics.decay.error_db, x); },
      [=](auto& c, double x) { as(c.octree.nodes[1].low_m.x, x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].high_m.z, x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].highest_key, x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].power[4], x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].cone_cos, x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].max_delay_s, x); },
      [](auto& c, double x) { c.octree.nodes[0].children[3] = x > 0 ? kNoNode : 0; },
      [](auto& c, double x) { c.octree.nodes[1].source_count = x > 0 && x < 9 ? 0 : 1000; },
      [](auto& c, double x) { c.octree.nodes[1].first_source = x > 0 && x < 9 ? 0 : 1000; },
      [=](auto& c, double x) { as(c.octree.sources[7].position_m.x, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].normal.y, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].mirror.z, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].delay_s, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].power[2], x); },
      [=](auto& c, double x) { as(c.octree.sources[7].patch_radius_m, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].u, x); },
      [](auto& c, double x) { c.octree.sources[7].material = x > 0 && x < 9 ? 1 : 2; },
      [](auto& c, double x) { c.octree.sources[7].emitter = x > 0 && x < 9 ? 0 : 1; },
      [=](auto& c, double x) { as(c.mesh.vertices_m[1].x, x); },
      [](auto& c, double x) { c.mesh.triangles[0][2] = x > 0 && x < 9 ? 3 : 4; },
      [](auto& c, double x) { c.mesh.materials[0] = x > 0 && x < 9 ? 1 : 2; },
      [](auto& c, double x) { c.mesh.materials.resize(x > 0 && x < 9 ? 2 : 1); },
      [=](auto& c, double x) { as(c.signals[0].samples[5], x); },
      [](auto& c, double x) { c.signals[0].samples.resize(x > 0 && x < 9 ? 1 : 0); },
      [](auto& c, double) { c.signals[0].samples.assign(kSampleRate_hz * 25, 0); },  // silence
      [](auto& c, double) { c.signals.clear(); },
      [](auto& c, double) { c.materials.clear(); },
  };
  const std::string path = path_of("property.clamor");
  int tried = 0, written_files = 0, refused = 0;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    for (const double x : {std::nan(""), -HUGE_VAL, -1e30, -1.0, -1e-30, 0.0, 1e-30, 0.5, 1.0, 5.0,
                           2e3, 1e7, 1e10, 1e25, 3e38, 1e300, HUGE_VAL}) {
      if (kSanitized && ++tried % 3 != 0) continue;  // slow
      BakeContents bake = contents();
      changes[i](bake, x);
      const auto done = write_bake(path, bake, 1);
      if (!done.ok()) {
        ++refused;
        EXPECT_NE(done.error().message.find("property.clamor: is not written"), std::string::npos)
            << done.error().message;
        EXPECT_FALSE(std::filesystem::exists(path));
        continue;
      }
      ++written_files;
      EXPECT_TRUE(read_whole(read(path)).ok()) << "change " << i << ", " << x;
      std::filesystem::remove(path);
    }
  }
  EXPECT_GT(written_files, kSanitized ? 66 : 200);
  EXPECT_GT(refused, kSanitized ? 66 : 200);
}

}  // namespace
}  // namespace clamor::testing
