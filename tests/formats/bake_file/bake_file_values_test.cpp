// bake_file_values_test.cpp: invalid values with valid checksums, and paths that are no files.
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/page.h"
#include "formats/files/atomic_file.h"
#include "tests/rooms.h"

namespace clamor {

namespace {

using Bytes = std::vector<std::byte>;

class BakeFileValues : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() / ("clamor_values_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  std::size_t file_count() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_), {}));
  }

  static BakeContents contents() {
    BakeContents made;
    made.materials = {testing::uniform_material(0.1f)};
    made.signals = {testing::sine()};
    made.emitters = {Emitter{.name = "e", .position_m = {1, 2, 3}}};
    OctreeNode& node = made.octree.nodes.emplace_back();
    node.low_m = {-7, 0, 0};
    node.high_m = {10, 10, 10};
    node.source_count = 2;
    Source wall, emitter;
    wall.position_m = {5, 0, 5};
    wall.normal = wall.mirror = {0, 1, 0};
    wall.power = same_in_all_bands(1);
    emitter.u = 0.5f;
    set_from_emitter(emitter, made.emitters[0]);
    made.octree.sources = {emitter, wall};
    return made;
  }

  Bytes written(const BakeContents& made) {
    const auto done = write_bake(at("a.clamor"), made, 1);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
    std::ifstream file(at("a.clamor"), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
  }

  static Preamble preamble_of(const Bytes& bytes) {
    Preamble preamble;
    std::memcpy(&preamble, bytes.data(), sizeof(preamble));
    return preamble;
  }

  // Updates the checksums of root and preamble.
  static void seal(Bytes& bytes, Preamble preamble) {
    preamble.root_hash =
        hash_of(std::span(bytes).subspan(preamble.root_offset, preamble.root_bytes));
    preamble.preamble_hash = hash_of(std::as_bytes(std::span(&preamble, 1)).first(56));
    std::memcpy(bytes.data(), &preamble, sizeof(preamble));
  }

  // Replaces the only float with this value in the root.
  static void replace_in_root(Bytes& bytes, float old_value, float value) {
    const Preamble preamble = preamble_of(bytes);
    int found = 0;
    for (std::size_t i = preamble.root_offset; i + 4 <= bytes.size(); i += 4) {
      float here = 0;
      std::memcpy(&here, &bytes[i], 4);
      if (here != old_value) continue;
      std::memcpy(&bytes[i], &value, 4);
      ++found;
    }
    ASSERT_EQ(found, 1);
    seal(bytes, preamble);
  }

  Result<BakeFile> opened(const Bytes& bytes) {
    std::ofstream(at("b.clamor"), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    return BakeFile::open(at("b.clamor"));
  }

  std::filesystem::path folder_;
};

TEST_F(BakeFileValues, ANewerMajorVersionIsNamedEvenIfItsChecksumDiffers) {
  Bytes bytes = written(contents());
  bytes[8] = std::byte{5};  // without updating checksums
  const auto file = opened(bytes);
  ASSERT_FALSE(file.ok());
  EXPECT_NE(file.error().message.find("format 5, but this build reads format 3. Update the player"),
            std::string::npos)
      << file.error().message;
}

TEST_F(BakeFileValues, ANodeOutsideTheCoordinateRangeIsRejected) {
  for (const float bad : {-3e6f, -3e38f, NAN, -INFINITY}) {
    Bytes bytes = written(contents());
    replace_in_root(bytes, -7, bad);
    EXPECT_FALSE(opened(bytes).ok()) << bad;
  }
  Bytes bytes = written(contents());
  replace_in_root(bytes, -7, -8);
  EXPECT_TRUE(opened(bytes).ok());
}

TEST_F(BakeFileValues, ANodeWithNegativePowerOrAnInvalidConeIsRejected) {
  for (const float bad : {-1.f, NAN, INFINITY}) {
    BakeContents made = contents();
    made.octree.nodes[0].power[3] = 123;
    Bytes bytes = written(made);
    replace_in_root(bytes, 123, bad);
    EXPECT_FALSE(opened(bytes).ok()) << "power " << bad;

    made = contents();
    made.octree.nodes[0].cone_cos = 0.625f;
    bytes = written(made);
    replace_in_root(bytes, 0.625f, bad == -1 ? 5.f : bad);
    EXPECT_FALSE(opened(bytes).ok()) << "cone " << bad;
  }
}

TEST_F(BakeFileValues, APageCannotDeclareAnInfinitePowerOrKey) {
  const BakeContents made = contents();
  Bytes page = encode_page(made.octree.nodes[0], made.octree.sources, 8);
  ASSERT_TRUE(decode_page(made.octree.nodes[0], page, made.emitters, 1).ok());
  // Bits 36 to 45 are the maximum power, in half decibels above 1e-24.
  const auto set_top = [&page](unsigned top) {
    for (unsigned bit = 0; bit < 10; ++bit) {
      std::byte& byte = page[(36 + bit) / 8];
      const auto mask = static_cast<std::byte>(1u << (36 + bit) % 8);
      byte = (top >> bit & 1) != 0 ? byte | mask : byte & ~mask;
    }
  };
  for (const unsigned top : {961u, 1000u, 1023u}) {
    set_top(top);
    EXPECT_FALSE(decode_page(made.octree.nodes[0], page, made.emitters, 1).ok()) << top;
  }
  set_top(960);
  const auto decoded = decode_page(made.octree.nodes[0], page, made.emitters, 1);
  ASSERT_TRUE(decoded.ok());
  for (const Source& source : *decoded) {
    float key = 0;
    for (const float power : source.power) key += power / 0x1p-32f;
    EXPECT_TRUE(std::isfinite(key));
  }
  EXPECT_NEAR((*decoded)[0].power[0], 1e24, 1e18);  // so it has the highest key
}

TEST_F(BakeFileValues, ALoudEmitterDoesNotSilenceFaintSourcesOfItsPage) {
  BakeContents made = contents();
  made.emitters[0].gain = 1e4;  // +80 dB
  set_from_emitter(made.octree.sources[0], made.emitters[0]);
  made.octree.sources[1].power = same_in_all_bands(1e-6f);  // -60 dB: 151 dB below the emitter
  const Bytes page = encode_page(made.octree.nodes[0], made.octree.sources, 8);
  const auto decoded = decode_page(made.octree.nodes[0], page, made.emitters, 1);
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ((*decoded)[0].power, made.octree.sources[0].power);
  for (const float power : (*decoded)[1].power) EXPECT_NEAR(power, 1e-6f, 1e-12f);
}

TEST_F(BakeFileValues, APipeIsRejectedWithoutBlocking) {
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  ::alarm(20);  // ends the test if opening blocks
  EXPECT_FALSE(BakeFile::open(at("pipe")).ok());
  ::alarm(0);
}

TEST_F(BakeFileValues, APipeOrADeviceIsNeverReplacedByAFile) {
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  ASSERT_EQ(::symlink("/dev/null", at("null").c_str()), 0);
  for (const char* name : {"pipe", "null"}) {
    auto file = AtomicFile::create(at(name));
    ASSERT_TRUE(file.ok());
    EXPECT_EQ(file_count(), 2u) << "a temporary beside " << name;
  }
  const auto written = write_bake(at("null"), contents(), 1);
  EXPECT_TRUE(written.ok()) << written.error().message;
  EXPECT_TRUE(std::filesystem::is_fifo(at("pipe")));
  EXPECT_TRUE(std::filesystem::is_symlink(at("null")));
  EXPECT_EQ(file_count(), 2u);
}

TEST_F(BakeFileValues, AFullDiskKeepsTheOldFile) {
  const Bytes before = written(contents());
  BakeContents larger = contents();
  larger.signals.resize(20, larger.signals[0]);
  rlimit old{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const rlim_t max_bytes : {0ul, 1ul, 64ul, 1000ul, before.size() + 1}) {
    const rlimit small{max_bytes, old.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    const auto done = write_bake(at("a.clamor"), larger, 1);
    ::setrlimit(RLIMIT_FSIZE, &old);
    ASSERT_FALSE(done.ok()) << max_bytes;
    EXPECT_NE(done.error().message.find("free some space"), std::string::npos);
    EXPECT_EQ(file_count(), 1u);
    EXPECT_TRUE(BakeFile::open(at("a.clamor")).ok());
    EXPECT_EQ(std::filesystem::file_size(at("a.clamor")), before.size());
  }
  std::signal(SIGXFSZ, handler);
}

}  // namespace

}  // namespace clamor
