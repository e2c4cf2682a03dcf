// bake_examples.h: a small bake file with every kind of content, for tests that read, modify and
// damage it.
#pragma once

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "common/random.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/bake_file/page.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/bake_file/source_quantization.h"

namespace clamor::testing {

using Bytes = std::string;

inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

inline std::string path_of(const std::string& name) {
  return (std::filesystem::temp_directory_path() /
          ("clamor_bake_file_" + std::to_string(::getpid()) + "_" + name))
      .string();
}

inline Bytes read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Opens the file and reads every part; returns the last error.
inline Result<void> read_all_of(const std::string& path, FileAccess access) {
  const auto file = BakeFile::open(path, access);
  if (!file.ok()) return file.error();
  Result<void> result;
  if (const auto sources = read_expanded_sources(*file); !sources.ok()) result = sources.error();
  for (std::size_t i = 0; i < file->signal_count(); ++i)
    if (const auto signal = file->read_signal(i); !signal.ok()) result = signal.error();
  for (std::size_t i = 0; i < file->signal_count(); ++i)
    if (const auto envelope = file->read_envelope(i); !envelope.ok()) result = envelope.error();
  if (const auto mesh = file->read_mesh(); !mesh.ok()) result = mesh.error();
  return result;
}

// Writes the bytes, opens them and reads every part, with and without mapping; both must agree.
inline Result<void> read_whole(const Bytes& bytes) {
  const std::string path = path_of("bytes.clamor");
  std::ofstream(path, std::ios::binary) << bytes;
  const Result<void> result = read_all_of(path, FileAccess::kRead);
  const Result<void> mapped = read_all_of(path, FileAccess::kMap);
  std::filesystem::remove(path);
  EXPECT_EQ(mapped.ok() ? "" : mapped.error().message, result.ok() ? "" : result.error().message);
  if (!result.ok()) {
    EXPECT_NE(result.error().message.find("bytes.clamor"), std::string::npos)
        << result.error().message;
  }
  return result;
}

inline Vec3f unit_vector(std::uint32_t i) {
  const RandomBits bits = philox(11, {i, 0, 0, 0});
  return Vec3f(normalize(Vec3(unit(bits[0]) - 0.5, unit(bits[1]) - 0.5, unit(bits[2]) - 0.5)));
}

inline Source random_source(std::uint32_t i) {
  const RandomBits a = philox(3, {i, 1, 0, 0}), b = philox(3, {i, 2, 0, 0});
  Source source;
  source.position_m = Vec3f(30 * unit(a[0]), 10 * unit(a[1]), 20 * unit(a[2]));
  source.normal = unit_vector(2 * i);
  source.mirror = unit_vector(2 * i + 1);
  source.delay_s = static_cast<float>(3 * unit(a[3]));
  for (std::size_t k = 0; k < kBandCount; ++k)
    source.power[k] =
        static_cast<float>(1e-3 * std::pow(0.3, static_cast<double>(k)) * (1 + i % 7));
  source.patch_radius_m = static_cast<float>(2 * unit(b[0]));
  source.u = static_cast<float>(unit_above_zero(b[1]));
  source.material = static_cast<std::uint16_t>(i % 2);
  source.polarity = (b[2] & 1) != 0 ? 1 : -1;
  return source;
}

// Two nodes with one emitter and `secondary` secondary sources.
inline BakeContents contents(std::uint32_t secondary = 100) {
  BakeContents bake;
  bake.settings.seed = 42;
  bake.settings.photons = 1000;
  bake.provenance = {"clamor test",
                     "room.glb",
                     0x1234567890abcdefull,
                     {"--emitter", "name=a b,signal=noise,at=0,0,0", "--seed", "3"},
                     {"Embree 9.9", "zstd 9.9"},
                     {{"room.glb", 123, 0xfedcba98u}, {"tone.wav", 45, 6}}};
  bake.statistics.decay = {4, {1, 2, 3, 4, 5, 6, 7, 0}, {.1f, .2f, .3f, .4f, 0, 0, 0, 0}, 0.25f};
  bake.statistics.photons_traced = 1000;
  bake.statistics.bounces = secondary;
  bake.statistics.warnings = {"mind the step"};
  bake.statistics.findings = {
      "9 % of the sound leaves the level",
      0.09,
      3,
      {{LevelFinding::Kind::kOpening, "a door", Vec3(1, 2, 3), 0.8, Vec3(0, 0, -1)},
       {LevelFinding::Kind::kOpening, "all round", std::nullopt, 0, Vec3(0)},
       {LevelFinding::Kind::kGap, "a slit", Vec3(0.1, 0, 4), 2.5, Vec3(0)}}};
  bake.materials.resize(2);
  bake.materials[0].name = "brick";
  bake.materials[1].name = "glass";
  Emitter emitter;
  emitter.name = "violin";
  emitter.position_m = {1.23456789, 2, 3};
  emitter.axis = normalize(Vec3(1, 2, 3));
  emitter.gain = 0.7;
  emitter.directivity = {0, 0, 1, 1, 2, 3, 4, 5};
  emitter.delay_s = 0.25;
  bake.emitters = {emitter};
  Signal signal;
  signal.name = "tone";
  for (int i = 0; i < 300; ++i)
    signal.samples.push_back(0.5f * std::sin(0.1f * static_cast<float>(i)));
  bake.signals = {signal};
  bake.mesh.vertices_m = {{0, 0, 0}, {1.0005f, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  bake.mesh.triangles = {{0, 1, 2}, {1, 2, 3}};
  bake.mesh.materials = {0, 1};
  bake.movable_parts = {
      {"door", box_mesh({0.5, 1, 0.02}, 1), {{1, 2, 3}, Rotation(0.8f, 0, 0.6f, 0)}}};

  Source primary;
  primary.u = 0.5f;
  set_from_emitter(primary, emitter);
  bake.octree.sources = {primary};
  for (std::uint32_t i = 0; i < secondary; ++i) bake.octree.sources.push_back(random_source(i));
  quantize_sources(bake.octree.sources, bake.materials);
  OctreeNode root;
  root.low_m = {0, 0, 0};
  root.high_m = {30, 10, 20};
  root.highest_key = 1;
  root.max_delay_s = 3;
  root.source_count = std::min<std::uint32_t>(60, secondary + 1);
  bake.octree.nodes = {root};
  if (root.source_count < secondary + 1) {
    OctreeNode child = root;
    child.first_source = root.source_count;
    child.source_count = secondary + 1 - root.source_count;
    bake.octree.nodes[0].children[3] = 1;
    bake.octree.nodes.push_back(child);
  }
  return bake;
}

inline Bytes written(const BakeContents& bake, int threads = 1) {
  const std::string path = path_of("written.clamor");
  const auto done = write_bake(path, bake, threads);
  EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
  Bytes bytes = read(path);
  std::filesystem::remove(path);
  return bytes;
}

// Updates sizes and checksums in the preamble.
inline void seal(Bytes& bytes) {
  Preamble preamble;
  std::memcpy(&preamble, bytes.data(), sizeof(preamble));
  preamble.file_bytes = bytes.size();
  preamble.root_bytes = bytes.size() - preamble.root_offset;
  const auto all = std::as_bytes(std::span(bytes));
  preamble.root_hash = hash_of(all.subspan(preamble.root_offset));
  std::memcpy(bytes.data(), &preamble, sizeof(preamble));
  preamble.preamble_hash = hash_of(all.first(kHashedPreambleBytes));
  std::memcpy(bytes.data(), &preamble, sizeof(preamble));
}

}  // namespace clamor::testing
