// bake_file_versions_test.cpp: files of all released format versions read as when they were
// written.
//
// golden/MAJOR.MINOR.clamor has every kind of content; the JSON beside it holds every value that
// its reader returned. Files are never regenerated once their format has been released: if this
// test fails, the reader is wrong. To add a version, raise kFormatMinor or kFormatMajor, run
// CLAMOR_WRITE_GOLDEN=1 build/release/tests/test_formats --gtest_filter='BakeFileVersions*' and
// commit both files. Release 0.1.0 will fix format 3.2; until then its file is regenerated whenever
// it changes, and 3.0 and 3.1 are treated as released. Formats 1 and 2 were never released and are
// an Error.
#include <cstdlib>

#include <nlohmann/json.hpp>

#include "formats/bake_file/signal_envelope.h"
#include "tests/build_paths.h"
#include "tests/formats/bake_examples.h"

namespace clamor::testing {
namespace {

using Json = nlohmann::ordered_json;

std::string golden(const std::string& name) {
  return std::string(testing::kSourceDir) + "/tests/formats/golden/" + name;
}

template <class Vector>
Json xyz(const Vector& v) {
  return {v.x, v.y, v.z};
}

// A node with two instances of a tree, one of which plays other signals.
BakeContents everything() {
  BakeContents made = contents(40);
  made.emitters.push_back(made.emitters[0]);
  made.emitters[1].name = "horn";
  made.signals.push_back(made.signals[0]);
  made.signals[1].name = "click";
  made.signals[1].loop = false;
  made.prototypes = {made.octree};
  made.signal_maps = {{1, 0}};
  OctreeNode top;
  top.low_m = {-200, -200, -200};
  top.high_m = {200, 200, 200};
  top.highest_key = 1e6f;
  top.max_delay_s = 10;
  top.power = made.octree.nodes[0].power;
  top.instance_count = 2;
  Instance first, second;
  first.offset_m = {100, 0, 0};
  first.u = 0.5f;
  second.offset_m = {0, 5, -100};
  second.rotation = glm::angleAxis(0.5f, glm::vec3(0, 1, 0));
  second.scale = 0.75f;
  second.gain = 0.5f;
  second.delay_s = 0.125f;
  second.u = 0.25f;
  second.signals = 0;
  second.emitters = 1;
  made.octree = {};
  made.octree.nodes = {top};
  made.octree.instances = {first, second};
  return made;
}

Json as_json(const Source& source) {
  return {{"position_m", xyz(source.position_m)},
          {"normal", xyz(source.normal)},
          {"mirror", xyz(source.mirror)},
          {"delay_s", source.delay_s},
          {"power", source.power},
          {"patch_radius_m", source.patch_radius_m},
          {"u", source.u},
          {"emitter", source.emitter},
          {"material", source.material},
          {"polarity", source.polarity},
          {"is_emitter", source.is_emitter}};
}

Json as_json(const NodeSummary& node) {
  return {{"low_m", xyz(node.low_m)},         {"high_m", xyz(node.high_m)},
          {"highest_key", node.highest_key},  {"power", node.power},
          {"cone_axis", xyz(node.cone_axis)}, {"cone_cos", node.cone_cos},
          {"min_delay_s", node.min_delay_s},  {"max_delay_s", node.max_delay_s},
          {"source_count", node.source_count}};
}

Json as_json(const Instance& copy) {
  const glm::quat& q = copy.rotation;
  return {{"tree", copy.tree},
          {"offset_m", xyz(copy.offset_m)},
          {"rotation", {q.w, q.x, q.y, q.z}},
          {"scale", copy.scale},
          {"gain", copy.gain},
          {"delay_s", copy.delay_s},
          {"number", copy.u},
          {"signals", copy.signals},
          {"emitters", copy.emitters}};
}

void add_making(const BakeFile& file, Json& json) {
  const BakeSettings& settings = file.settings();
  const Provenance& provenance = file.provenance();
  const BakeStatistics& statistics = file.statistics();
  json["version"] = {file.major(), file.minor()};
  json["settings"] = {settings.seed,
                      settings.photons,
                      settings.sources,
                      settings.roulette_exponent,
                      settings.longest_path_s,
                      settings.air.temperature_c,
                      settings.air.humidity_percent,
                      settings.air.pressure_kpa};
  json["provenance"] = {{"tool", provenance.tool},           {"level", provenance.level},
                        {"hash", provenance.input_hash},     {"arguments", provenance.arguments},
                        {"libraries", provenance.libraries}, {"inputs", Json::array()}};
  for (const InputFile& input : provenance.inputs)
    json["provenance"]["inputs"].push_back({input.name, input.bytes, input.hash});
  const DecaySummary& decay = statistics.decay;
  json["statistics"] = {
      {"traced", statistics.photons_traced},
      {"bounces", statistics.bounces},
      {"escaped", statistics.photons_escaped},
      {"mean_free_path_m", statistics.mean_free_path_m},
      {"rooms", statistics.rooms},
      {"deposits", statistics.deposits},
      {"power", {statistics.power_emitted, statistics.power_escaped, statistics.power_unfinished}},
      {"warnings", statistics.warnings},
      {"decay", {decay.places, decay.t30_s, decay.t30_error_s, decay.error_db}}};
}

void add_tables(const BakeFile& file, Json& json) {
  for (const Material& material : file.materials())
    json["materials"].push_back({material.name, material.absorption, material.scattering,
                                 material.phong, material.transmission});
  for (const Emitter& emitter : file.emitters())
    json["emitters"].push_back({emitter.name, xyz(emitter.position_m), xyz(emitter.axis),
                                emitter.gain, emitter.directivity, emitter.signal,
                                emitter.delay_s});
  json["signal_maps"] = file.signal_maps();
  for (const auto& depths : file.depths())
    for (const OctreeDepth& depth : depths)
      json["levels"].push_back({depth.nodes, depth.sources, depth.packed_bytes, depth.power});
}

// Every value that the reader returns.
Json read_whole_as_json(const BakeFile& file) {
  Json json;
  add_making(file, json);
  add_tables(file, json);
  const auto pages = file.for_each_page([&](const PageEntry& entry, const OctreePage& page,
                                            std::size_t tree, std::size_t depth) -> Result<void> {
    Json one = {
        {"tree", tree}, {"depth", depth}, {"node", as_json(entry)}, {"octant", entry.octant}};
    for (const Source& source : page.sources) one["sources"].push_back(as_json(source));
    for (const Instance& copy : page.links.instances) one["copies"].push_back(as_json(copy));
    json["pages"].push_back(one);
    return {};
  });
  EXPECT_TRUE(pages.ok()) << (pages.ok() ? "" : pages.error().message);
  for (std::size_t i = 0; i < file.signal_count(); ++i) {
    const auto signal = file.read_signal(i);
    EXPECT_TRUE(signal.ok());
    if (signal.ok()) json["signals"].push_back({signal->name, signal->loop, signal->samples});
    EXPECT_TRUE(file.read_envelope(i).ok());
  }
  const auto mesh = file.read_mesh();
  EXPECT_TRUE(mesh.ok());
  if (mesh.ok()) {
    for (const Vec3f& vertex : mesh->vertices_m) json["vertices"].push_back(xyz(vertex));
    json["triangles"] = mesh->triangles;
    json["triangle_materials"] = mesh->materials;
  }
  for (const MovablePart& part : file.movable_parts()) {
    const auto& [name, shape, pose] = part;
    Json vertices;
    for (const Vec3f& vertex : shape.vertices_m) vertices.push_back(xyz(vertex));
    json["movable_parts"].push_back({name, vertices, shape.triangles, shape.materials,
                                     xyz(pose.position_m), xyz(pose.rotation), pose.rotation.w,
                                     pose.scale});
  }
  return json;
}

std::string this_version() {
  return std::to_string(kFormatMajor) + "." + std::to_string(kFormatMinor);
}

TEST(BakeFileVersions, OfAllReleasedVersionsAreReadUnchanged) {
  if (std::getenv("CLAMOR_WRITE_GOLDEN") != nullptr) {
    const std::string path = golden(this_version() + ".clamor");
    std::filesystem::create_directories(golden(""));
    const auto done = write_bake(path, everything(), 1);
    ASSERT_TRUE(done.ok()) << done.error().message;
    std::ofstream(golden(this_version() + ".json"))
        << read_whole_as_json(*BakeFile::open(path)).dump(1) << '\n';
  }
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(golden(""))) {
    if (entry.path().extension() != ".clamor") continue;
    ++files;
    const auto file = BakeFile::open(entry.path().string());
    ASSERT_TRUE(file.ok()) << file.error().message;
    auto expected = entry.path();
    std::ifstream stored(expected.replace_extension(".json"));
    const Json before = Json::parse(stored), now = read_whole_as_json(*file);
    for (const auto& [key, value] : before.items()) {
      ASSERT_TRUE(now.contains(key)) << key;
      EXPECT_EQ(Json::parse(now[key].dump()), value) << entry.path() << ": " << key;
    }
  }
  EXPECT_GE(files, 1u);
}

TEST(BakeFileVersions, IncludeTheCurrentVersion) {
  EXPECT_TRUE(std::filesystem::exists(golden(this_version() + ".clamor")))
      << "see the top of bake_file_versions_test.cpp";
}

TEST(BakeFileVersions, MatchTheCurrentWriter) {
  // Compares values, because other library versions may encode them differently.
  const std::string path = path_of("golden.clamor");
  const auto done = write_bake(path, everything(), 1);
  ASSERT_TRUE(done.ok()) << done.error().message;
  const Json now = read_whole_as_json(*BakeFile::open(path));
  std::filesystem::remove(path);
  std::ifstream stored(golden(this_version() + ".json"));
  const Json before = Json::parse(stored);
  for (const char* key : {"settings", "provenance", "statistics", "materials", "emitters", "pages",
                          "signal_maps", "vertices", "triangles", "movable_parts"})
    EXPECT_EQ(Json::parse(now[key].dump()), before[key]) << key;
}

}  // namespace
}  // namespace clamor::testing
