#include "formats/bake_file/bake_file.h"

#include <csignal>
#include <limits>

#include <sys/resource.h>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/signal_envelope.h"
#include "tests/formats/bake_examples.h"
#include "tests/sanitized.h"

namespace clamor::testing {
namespace {

// Errors of all parts of an open file; "" for readable parts.
std::vector<std::string> complaints(const BakeFile& file) {
  std::vector<std::string> all;
  const auto add = [&](const auto& part) { all.push_back(part.ok() ? "" : part.error().message); };
  for (const PageEntry& top : file.trees()) add(file.read_page(top));
  add(read_expanded_sources(file));
  add(file.read_signal(0));
  add(file.read_envelope(0));
  add(file.read_mesh());
  return all;
}

TEST(BakeFile, TruncatedOrOverwrittenWhileOpenIsTheSameErrorMappedAndRead) {
  const std::string path = path_of("cut.clamor"), garbage(1 << 20, '\xa5');
  for (const std::uint32_t sources : {100u, 1000u}) {
    ASSERT_TRUE(write_bake(path, contents(sources), 2).ok());
    const Bytes whole = read(path);
    const auto file = BakeFile::open(path), mapped = BakeFile::open(path, FileAccess::kMap);
    ASSERT_TRUE(file.ok() && mapped.ok());
    ASSERT_TRUE(mapped->is_mapped());
    ASSERT_FALSE(file->is_mapped());
    EXPECT_EQ(complaints(*mapped), std::vector<std::string>(5));
    for (std::size_t length = 0; length < whole.size(); length += 997) {
      std::filesystem::resize_file(path, length);
      const auto all = complaints(*file);
      EXPECT_EQ(complaints(*mapped), all) << length;
      if (length == 0)
        for (const std::string& one : all) {
          EXPECT_NE(one.find("cut short while it was open"), std::string::npos) << one;
          EXPECT_EQ(one.find(path), 0u) << one;
        }
      std::ofstream(path, std::ios::binary) << whole.substr(0, length) << garbage;
      EXPECT_EQ(complaints(*mapped), complaints(*file)) << length;
      std::ofstream(path, std::ios::binary) << whole;
    }
    EXPECT_EQ(complaints(*mapped), std::vector<std::string>(5));
    std::filesystem::remove(path);
  }
}

TEST(BakeFile, ReplacedWhileOpenKeepsItsContents) {
  const std::string path = path_of("replaced.clamor");
  for (const FileAccess access : {FileAccess::kRead, FileAccess::kMap}) {
    BakeContents bake = contents();
    ASSERT_TRUE(write_bake(path, bake, 2).ok());
    const auto file = BakeFile::open(path, access);
    ASSERT_TRUE(file.ok());
    EXPECT_EQ(file_version(path), file->version());
    const auto before = read_expanded_sources(*file);
    bake.octree = {};
    ASSERT_TRUE(write_bake(path, bake, 2).ok());
    EXPECT_NE(file_version(path), file->version());
    const auto after = read_expanded_sources(*file);
    ASSERT_TRUE(before.ok() && after.ok());
    EXPECT_EQ(before->sources.size(), after->sources.size());
    EXPECT_GT(after->sources.size(), 0u);
    std::filesystem::remove(path);
  }
}

TEST(BakeFile, RoundTrips) {
  const BakeContents bake = contents();
  const std::string path = path_of("whole.clamor");
  ASSERT_TRUE(write_bake(path, bake, 2).ok());
  const auto file = BakeFile::open(path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(file->settings().seed, 42u);
  EXPECT_EQ(file->provenance().level, "room.glb");
  EXPECT_EQ(file->provenance().input_hash, 0x1234567890abcdefull);
  EXPECT_EQ(file->provenance().arguments, bake.provenance.arguments);
  EXPECT_EQ(file->provenance().libraries, bake.provenance.libraries);
  EXPECT_EQ(file->provenance().inputs, bake.provenance.inputs);
  EXPECT_EQ(file->statistics().decay, bake.statistics.decay);
  EXPECT_EQ(file->settings().sources, bake.settings.sources);
  EXPECT_EQ(file->statistics().rooms, bake.statistics.rooms);
  EXPECT_EQ(file->statistics().deposits, bake.statistics.deposits);
  EXPECT_EQ(file->statistics().warnings, bake.statistics.warnings);
  EXPECT_EQ(file->statistics().findings, bake.statistics.findings);
  EXPECT_EQ(file->materials(), bake.materials);
  EXPECT_EQ(file->emitters(), bake.emitters);
  EXPECT_EQ(file->source_count(), 101u);
  EXPECT_EQ(file->bytes().file, std::filesystem::file_size(path));

  const auto sources = read_expanded_sources(*file);
  ASSERT_TRUE(sources.ok());
  ASSERT_EQ(sources->sources.size(), 101u);
  for (std::size_t i = 0; i < sources->sources.size(); ++i) {
    const Source &before = bake.octree.sources[i], &after = sources->sources[i];
    EXPECT_EQ(after.power, before.power) << i;  // already quantized, so exact
    EXPECT_EQ(after.u, before.u) << i;
    EXPECT_EQ(after.polarity, before.polarity) << i;
    EXPECT_EQ(after.is_emitter, before.is_emitter) << i;
    EXPECT_EQ(after.material, before.material) << i;
    EXPECT_EQ(after.emitter, before.emitter) << i;
    EXPECT_EQ(after.position_m, before.position_m) << i;
    EXPECT_EQ(after.normal, before.normal) << i;
    EXPECT_EQ(after.mirror, before.mirror) << i;
    EXPECT_EQ(after.delay_s, before.delay_s) << i;
    EXPECT_EQ(after.patch_radius_m, before.patch_radius_m) << i;
  }

  const auto signal = file->read_signal(0);
  ASSERT_TRUE(signal.ok());
  ASSERT_EQ(signal->samples.size(), 300u);
  for (std::size_t i = 0; i < 300; ++i)
    EXPECT_NEAR(signal->samples[i], bake.signals[0].samples[i], 1.0 / (1 << 23));
  const auto mesh = file->read_mesh();
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->triangles, bake.mesh.triangles);
  EXPECT_EQ(mesh->materials, bake.mesh.materials);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_LE(length(mesh->vertices_m[i] - bake.mesh.vertices_m[i]), 0.9e-3f);
  std::filesystem::remove(path);
}

TEST(BakeFile, IsTheSameBytesOn1And2And7Threads) {
  const Bytes one = written(contents(), 1);
  EXPECT_TRUE(one == written(contents(), 2));
  EXPECT_TRUE(one == written(contents(), 7));
}

TEST(BakeFile, KeepsSignalsBeyondFullScale) {
  BakeContents bake = contents();
  for (float& sample : bake.signals[0].samples) sample *= 5;
  const std::string path = path_of("loud.clamor");
  ASSERT_TRUE(write_bake(path, bake, 1).ok());
  const auto signal = BakeFile::open(path)->read_signal(0);
  std::filesystem::remove(path);
  ASSERT_TRUE(signal.ok());
  for (std::size_t i = 0; i < 300; ++i)
    EXPECT_NEAR(signal->samples[i], bake.signals[0].samples[i], 3.0 / (1 << 23));
}

// A report would say that 4294967295 more of them are not shown.
TEST(BakeFile, HasNoFewerThinGapsThanItLists) {
  BakeContents bake = contents();
  bake.statistics.findings.thin_gaps = 0;
  const auto bytes = bake_bytes("room", bake, 1);
  ASSERT_FALSE(bytes.ok());
  EXPECT_NE(bytes.error().message.find("fewer thin gaps than are listed"), std::string::npos);
}

// A gap may be longer than any coordinate, in a level of 2000 km and more.
TEST(BakeFile, KeepsFindingsWhoseNumbersItCannotHold) {
  constexpr double kHuge_m = 3e6, kInfinite = std::numeric_limits<double>::infinity(),
                   kNone = std::numeric_limits<double>::quiet_NaN();
  using Kind = LevelFinding::Kind;
  BakeContents bake = contents();
  bake.statistics.findings = {"open", 0.5, 1000, {}};
  auto& list = bake.statistics.findings.list;
  list.push_back({Kind::kOpening, "not a number", Vec3(1), kNone, Vec3(kNone, 0, 1)});
  list.push_back({Kind::kOpening, "nowhere", Vec3(0, kInfinite, 0), 2, Vec3(0, 1, 0)});
  for (int i = 0; i < 1000; ++i) list.push_back({Kind::kGap, "long", Vec3(1, 2, 3), kHuge_m, {}});
  const std::string path = path_of("huge.clamor");
  const auto done = write_bake(path, bake, 1);
  ASSERT_TRUE(done.ok()) << done.error().message;
  const auto file = BakeFile::open(path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  LevelFindings kept = bake.statistics.findings;
  for (LevelFinding& finding : kept.list)
    if (finding.text != "nowhere") finding.size_m = 0;
  kept.list[0].direction = Vec3(0);
  kept.list[1].place_m.reset();
  EXPECT_EQ(file->statistics().findings, kept);
}

TEST(BakeFile, MayHoldNoTrianglesAndNoSources) {
  BakeContents bake = contents();
  bake.mesh = {};
  bake.octree = {};
  EXPECT_TRUE(read_whole(written(bake)).ok());
}

TEST(BakeFile, TruncatedAtAnyByteIsRejected) {
  const Bytes whole = written(contents());
  ASSERT_TRUE(read_whole(whole).ok());
  for (std::size_t size = 0; size < whole.size(); ++size)
    ASSERT_FALSE(read_whole(whole.substr(0, size)).ok()) << size << " bytes";
}

TEST(BakeFile, WithAnyFlippedBitInPreambleOrRootIsRejected) {
  const Bytes whole = written(contents());
  Preamble preamble;
  std::memcpy(&preamble, whole.data(), sizeof(preamble));
  const auto refused = [&](std::size_t byte) {
    for (std::size_t bit = 0; bit < 8; ++bit) {
      if (testing::kSanitized && bit != byte % 8) continue;  // slow
      Bytes flipped = whole;
      flipped[byte] = static_cast<char>(flipped[byte] ^ (1 << bit));
      ASSERT_FALSE(read_whole(flipped).ok()) << "byte " << byte << ", bit " << bit;
    }
  };
  for (std::size_t byte = 0; byte < sizeof(preamble); ++byte) refused(byte);
  for (std::size_t byte = preamble.root_offset; byte < whole.size(); ++byte) refused(byte);
}

TEST(BakeFile, WithAFlippedBitOutsidePaddingIsRejected) {
  const Bytes whole = written(contents());
  Preamble preamble;
  std::memcpy(&preamble, whole.data(), sizeof(preamble));
  const std::size_t start = sizeof(preamble), end = preamble.root_offset;
  for (std::size_t bit = 8 * start; bit < 8 * (end - 7); bit += testing::kSanitized ? 25 : 5) {
    Bytes flipped = whole;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
    ASSERT_FALSE(read_whole(flipped).ok()) << "bit " << bit;
  }
}

TEST(BakeFile, OfANewerMinorVersionIsReadOfANewerMajorVersionRejected) {
  const auto version = [](std::uint16_t major, std::uint16_t minor) {
    Bytes bytes = written(contents());
    std::memcpy(bytes.data() + 8, &major, 2);
    std::memcpy(bytes.data() + 10, &minor, 2);
    seal(bytes);
    return read_whole(bytes);
  };
  EXPECT_TRUE(version(kFormatMajor, kFormatMinor + 1).ok());
  const auto newer = version(kFormatMajor + 1, 0);
  ASSERT_FALSE(newer.ok());
  EXPECT_NE(newer.error().message.find("format 4, but this build reads format 3"),
            std::string::npos)
      << newer.error().message;
}

TEST(Page, ThatClaimsFourGigabytesAllocatesNothing) {
  // A zstd frame header that declares 4 GB, without data.
  const std::uint8_t frame[] = {0x28, 0xb5, 0x2f, 0xfd, 0xe0, 0, 0, 0, 0, 1, 0, 0, 0};
  std::vector<std::byte> room(max_page_bytes(10), std::byte{7});
  EXPECT_FALSE(ZstdDecompressor().unpack(std::as_bytes(std::span(frame)), room).ok());
  EXPECT_EQ(room, std::vector<std::byte>(room.size(), std::byte{7}));
}

TEST(Page, RoundsPowersToHalfDecibelsWithoutBias) {
  double before = 0, after = 0, squares = 0;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) {
    Source source;
    source.power.fill(1.03f);  // 0.128 dB, which rounding to nearest would lose
    source.u = static_cast<float>((i + 1.0) / kCount);
    round_powers_stochastically(source);
    const double steps = 20 * std::log10(static_cast<double>(source.power[2]));
    EXPECT_NEAR(steps, std::round(steps), 1e-4);
    EXPECT_LE(std::abs(steps - 20 * std::log10(1.03)), 1.0);
    before += 1.03;
    after += source.power[2];
    squares += std::pow(source.power[2] - 1.03, 2);
  }
  EXPECT_LE(std::abs(after - before), 4 * std::sqrt(squares));
}

TEST(AtomicWrite, KeepsTheOldFileIfTheDiskIsFull) {
  const std::string folder = path_of("folder");
  std::filesystem::create_directory(folder);
  const std::string path = folder + "/out.clamor";
  ASSERT_TRUE(write_bake(path, contents(10), 1).ok());
  const Bytes old = read(path);

  // A file size limit simulates a full disk.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (rlim_t limit = 0; limit < old.size(); limit += 512) {
    const rlimit small{limit, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    const auto done = write_bake(path, contents(100), 1);
    setrlimit(RLIMIT_FSIZE, &before);
    ASSERT_FALSE(done.ok());
    EXPECT_NE(done.error().message.find("out.clamor"), std::string::npos);
    EXPECT_TRUE(read(path) == old);
    const auto files = std::filesystem::directory_iterator(folder);
    EXPECT_EQ(std::distance(begin(files), end(files)), 1);
  }
  std::signal(SIGXFSZ, handler);
  std::filesystem::remove_all(folder);
}

TEST(AtomicWrite, ReportsWhyItCannotWrite) {
  for (const std::string& path :
       {std::string("/dev/null/out.clamor"), std::string("/proc/out.clamor"),
        std::filesystem::temp_directory_path().string()}) {
    const auto done = write_bake(path, contents(10), 1);
    ASSERT_FALSE(done.ok()) << path;
    EXPECT_NE(done.error().message.find(path), std::string::npos) << done.error().message;
  }
}

}  // namespace
}  // namespace clamor::testing
