// Tests that the figures of inspect add up and that all of its JSON keys are documented.
#include <cmath>
#include <map>
#include <regex>
#include <tuple>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/bake_file/bake_writer.h"
#include "tests/baked_room.h"
#include "tests/build_paths.h"
#include "tests/portal_rooms.h"
#include "tests/tools/run_clamor.h"
#include "tools/report/bake_overview.h"

namespace clamor::testing {

namespace {

using Json = nlohmann::json;

class InspectCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<Folder>();
    ASSERT_TRUE(write_bake(path(), contents(), 1).ok());
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static const BakeContents& contents() {
    static const BakeContents made = [] {
      BakeContents baked = baked_contents(300);
      baked.provenance.level = "room.glb";
      baked.provenance.inputs = {{"room.glb", 1234567, 0xabcdefu}};
      baked.statistics.warnings = {"mind the step"};
      baked.movable_parts = {{"door", box_mesh({0.5, 1, 0.02}, 0), {{1, 1, 2}}}};
      return baked;
    }();
    return made;
  }
  static std::string path() { return *folder_ / "a.clamor"; }

  static std::string shown(std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"inspect", path()});
    const Outcome outcome = clamor(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  }

  static std::unique_ptr<Folder> folder_;
};
std::unique_ptr<Folder> InspectCommand::folder_;

TEST_F(InspectCommand, TellsOfEachDepthWhatItsSourcesAddUpTo) {
  const Json json = Json::parse(shown({"--json"}));
  const std::vector<Source>& sources = contents().octree.sources;
  std::uint64_t nodes = 0, count = 0, bytes = 0;
  std::array<double, kBandCount> power{}, share{};
  for (const Json& level : json["octree"]) {
    nodes += level["nodes"].get<std::uint64_t>();
    count += level["sources"].get<std::uint64_t>();
    bytes += level["packed_bytes"].get<std::uint64_t>();
    for (std::size_t b = 0; b < kBandCount; ++b) {
      power[b] += level["power"][b].get<double>();
      share[b] += level["power_share"][b].get<double>();
    }
  }
  EXPECT_GT(json["octree"].size(), 1u);
  EXPECT_EQ(nodes, json["page_count"]);
  EXPECT_EQ(count, sources.size());
  EXPECT_EQ(bytes, json["bytes"]["pages"]);
  EXPECT_EQ(json["instanced"]["trees"], 0);
  std::array<double, kBandCount> expected{};
  for (const Source& source : sources)
    for (std::size_t b = 0; b < kBandCount; ++b)
      expected[b] += static_cast<double>(source.power[b]);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_NEAR(power[b] / expected[b], 1, 1e-5);  // single precision
    EXPECT_NEAR(json["power"]["in_sources"][b].get<double>() / expected[b], 1, 1e-5);
    EXPECT_NEAR(share[b], 1, 1e-5);
  }
  // The first page holds the sources of highest key, so more than its share of the power.
  const Json& first = json["octree"][0];
  EXPECT_GT(first["power_share"][4].get<double>(),
            first["sources"].get<double>() / static_cast<double>(sources.size()));
}

TEST_F(InspectCommand, SharesOutEveryByteOfTheFile) {
  const Json json = Json::parse(shown({"--json", "--pages"}));
  const Json& bytes = json["bytes"];
  const auto sections = bytes["pages"].get<std::uint64_t>() +
                        bytes["signals"].get<std::uint64_t>() +
                        bytes["geometry"].get<std::uint64_t>() + bytes["root"].get<std::uint64_t>();
  const auto file = bytes["file"].get<std::uint64_t>();
  EXPECT_EQ(file, std::filesystem::file_size(path()));
  EXPECT_LE(sections, file);
  EXPECT_LE(file - sections, 64u + 7u);  // the preamble, and padding before the root
  EXPECT_NEAR(bytes["pages_per_source"].get<double>() * json["sources"]["stored"].get<double>(),
              bytes["pages"].get<double>(), 1);
  EXPECT_NEAR(bytes["compression_ratio"].get<double>() * bytes["pages"].get<double>(),
              bytes["pages_unpacked"].get<double>(), 1);
  EXPECT_GT(bytes["signals_decoded"].get<std::uint64_t>(), 0u);
  ASSERT_EQ(json["pages"].size(), json["page_count"].get<std::size_t>());
  std::uint64_t packed = 0, sources = 0;
  for (const Json& page : json["pages"]) {
    packed += page["packed_bytes"].get<std::uint64_t>();
    sources += page["sources"].get<std::uint64_t>();
  }
  EXPECT_EQ(packed, bytes["pages"]);
  EXPECT_EQ(sources, json["sources"]["total"]);
  std::uint64_t of_geometry = 0, triangles = 0;
  for (const Json& page : json["geometry_pages"]) {
    of_geometry += page["packed_bytes"].get<std::uint64_t>();
    triangles += page["triangles"].get<std::uint64_t>();
  }
  EXPECT_EQ(of_geometry, bytes["geometry"]);
  EXPECT_GT(of_geometry, 0u);
  EXPECT_EQ(triangles, json["geometry"]["triangles"]);
  EXPECT_EQ(json["geometry_pages"].size(), json["geometry"]["page_count"].get<std::size_t>());
}

// Collects a JSON key with its path. Takes `above` by value, because `keys` may reallocate.
void collect_keys(const Json& json, std::string above, std::vector<std::string>& keys) {
  if (json.is_array() && !json.empty()) return collect_keys(json[0], above, keys);
  if (!json.is_object()) return;
  for (const auto& [key, value] : json.items()) {
    keys.push_back(above.empty() ? key : above + "." + key);
    collect_keys(value, keys.back(), keys);
  }
}

TEST_F(InspectCommand, CallsAMirrorAMirrorAndGivesNoLobeToWhatIsAllScattered) {
  BakeContents baked = contents();
  Material& material = baked.materials[0];
  const std::string other = *folder_ / "other.clamor";
  for (const auto& [exponent, scattering, printed] :
       {std::tuple(kMirrorExponent, 0.25f, "0.25 mirror"),
        {50.0f, 0.25f, "0.25     50"},
        {kMirrorExponent, 1.0f, "1.00      -"}}) {
    material.phong = same_in_all_bands(exponent);
    material.scattering = same_in_all_bands(scattering);
    ASSERT_TRUE(write_bake(other, baked, 1).ok());
    const Outcome inspected = clamor({"inspect", other});
    EXPECT_NE(inspected.out.find(printed), std::string::npos) << inspected.out;
  }
}

TEST_F(InspectCommand, WritesNoJsonKeyThatTheSpecificationDoesNotTell) {
  const std::string text = read(std::string(testing::kSourceDir) + "/formats/bake_format.md");
  const auto start = text.find("## `clamor inspect --json`");
  ASSERT_NE(start, std::string::npos);
  std::map<std::string, std::string> rows;  // row of the table for each top-level key
  const std::regex line("\\| `([a-z0-9_]+)` \\| ([^\n]*) \\|\n");
  for (auto row = std::sregex_iterator(text.begin() + static_cast<std::ptrdiff_t>(start),
                                       text.end(), line);
       row != std::sregex_iterator(); ++row)
    rows[(*row)[1]] = (*row)[2];
  std::vector<std::string> keys;
  collect_keys(Json::parse(shown({"--json", "--pages"})), "", keys);
  EXPECT_GT(keys.size(), 60u);
  for (const std::string& key : keys) {
    const std::string first = key.substr(0, key.find('.'));
    ASSERT_TRUE(rows.contains(first)) << key;
    const std::string last = key.substr(key.rfind('.') + 1);
    EXPECT_TRUE(last == first || rows[first].find("`" + last + "`") != std::string::npos) << key;
  }
  for (const auto& [key, told] : rows)
    EXPECT_TRUE(std::count(keys.begin(), keys.end(), key) == 1) << key << " is told, not written";
}

TEST_F(InspectCommand, ShowsEveryTableAndTheWarnings) {
  const std::string text = shown({"--verify"});
  for (const char* part :
       {"Clamor bake, format", "warning: mind the step", "acoustics", "3 emitters", "1 material",
        "power by octree depth", "octree", "bytes/source", "geometry", "how it was made",
        "clamor bake room.glb", "1 234 567 bytes", "1 movable part", "verified: every page"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120u) << line;
}

TEST(InspectDoors, SaysWhichPartOpensWhichPortal) {
  BakeContents rooms = baked_portal_rooms();
  rooms.movable_parts = {{"Door", box_mesh({0.5, 1, 0.02}, 0), {{6, 1, 2.5}}}};
  rooms.portals.portals[0].name = "gate";
  const Folder folder;
  const std::string file = folder / "rooms.clamor";
  ASSERT_TRUE(write_bake(file, rooms, 1).ok());
  EXPECT_EQ(clamor({"inspect", file}).out.find("opened by"), std::string::npos);
  rooms.portals.portals[0].parts = {0};
  ASSERT_TRUE(write_bake(file, rooms, 1).ok());
  const std::string out = clamor({"inspect", file}).out;
  EXPECT_NE(out.find("2.00 m  6.00 1.00 2.50  opened by 'Door'\n"), std::string::npos) << out;
}

TEST(InspectProbes, CountsTheirBytesAmongThoseOfTheFile) {
  BakeOptions options;
  options.settings.photons = 200;
  options.probes_m = {{2, 1.5, 2}};
  const auto rooms = bake(portal_rooms(), options);
  ASSERT_TRUE(rooms.ok()) << rooms.error().message;
  const Folder folder;
  const std::string file = folder / "rooms.clamor";
  ASSERT_TRUE(write_bake(file, *rooms, 1).ok());
  const std::string out = clamor({"inspect", file}).out;
  const auto table = out.find("\nbytes ");
  ASSERT_NE(table, std::string::npos) << out;
  EXPECT_LT(out.find("\n  probes ", table), out.find("\n  file ", table)) << out;
}

TEST(Names, OfAForgedBakeAreShortenedInEveryOutput) {
  const Folder folder;
  const std::string file = folder / "forged.clamor", page = folder / "page.html";
  const std::string name = "begin" + std::string(1'000'000, 'x') + "end";
  const std::string too_long(4097, 'x');
  BakeContents forged = baked_portal_rooms();
  forged.movable_parts = {{name, box_mesh({0.5, 1, 0.02}, 0), {{6, 1, 2.5}}}};
  for (Material& material : forged.materials) material.name = name;
  forged.emitters[0].name = forged.signals[0].name = forged.portals.portals[0].name = name;
  forged.statistics.warnings = {name, name + "2"};
  forged.statistics.findings.closedness = name;
  forged.statistics.findings.list = {
      {LevelFinding::Kind::kOpening, name, Vec3(1, 2, 3), 0.8, Vec3(0, 0, -1)}};
  forged.provenance.tool = forged.provenance.level = name;
  forged.provenance.inputs = {{name, 1, 2}};
  forged.provenance.arguments = {"--emitter", name};
  forged.provenance.libraries = {name};
  const auto written = write_bake(file, forged, 1);
  ASSERT_TRUE(written.ok()) << written.error().message.substr(0, 1000);

  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"inspect", file},
        {"inspect", file, "--json"},
        {"diff", file, file, "--json"},
        {"report", file, "-o", page},
        {"impulse", file, "--listener", "0,1,3", "--from", "nobody"}}) {
    const Outcome outcome = clamor(words);
    EXPECT_EQ(outcome.out.find(too_long), std::string::npos) << words[0];
    EXPECT_EQ(outcome.err.find(too_long), std::string::npos) << words[0];
    EXPECT_EQ(outcome.code, words[0] == "impulse" ? 1 : 0) << outcome.err.substr(0, 1000);
  }
  EXPECT_EQ(read(page).find(too_long), std::string::npos);
  const auto json = Json::parse(clamor({"inspect", file, "--json"}).out);
  const std::string shown = json["emitters"][0]["name"];
  EXPECT_LE(shown.size(), 500u);
  EXPECT_TRUE(shown.starts_with("beginx") && shown.ends_with("xend")) << shown;
}

TEST_F(InspectCommand, ListsEveryPageWhenItIsAskedTo) {
  const Json json = Json::parse(shown({"--json", "--pages"}));
  const std::string text = shown({"--pages"});
  std::istringstream lines(text.substr(text.find("  tree depth      offset")));
  std::string header;
  std::getline(lines, header);
  for (const Json& page : json["pages"]) {
    std::uint64_t tree = 0, depth = 0, offset = 0, packed = 0, sources = 0, children = 0,
                  instances = 0;
    lines >> tree >> depth >> offset >> packed >> sources >> children >> instances;
    EXPECT_EQ(depth, page["depth"]);
    EXPECT_EQ(offset, page["offset"]);
    EXPECT_EQ(packed, page["packed_bytes"]);
    EXPECT_EQ(sources, page["sources"]);
    EXPECT_EQ(children, page["children"]);
  }
  std::istringstream rest(text.substr(text.find("  geometry        offset")));
  std::getline(rest, header);
  for (const Json& page : json["geometry_pages"]) {
    std::uint64_t number = 0, offset = 0, packed = 0, triangles = 0, vertices = 0;
    rest >> number >> offset >> packed >> triangles >> vertices;
    EXPECT_EQ(offset, page["offset"]);
    EXPECT_EQ(packed, page["packed_bytes"]);
    EXPECT_EQ(triangles, page["triangles"]);
    EXPECT_EQ(vertices, page["vertices"]);
  }
}

TEST_F(InspectCommand, VerifyNamesTheFirstPageThatIsDamaged) {
  const Json json = Json::parse(shown({"--json", "--pages"}));
  const std::string damaged = *folder_ / "damaged.clamor";
  const std::size_t last = json["pages"].size() - 1;
  const auto offset_of = [&](std::size_t page) {
    return json["pages"][page]["offset"].get<std::size_t>();
  };
  for (const std::size_t page : {std::size_t{0}, last / 2, last}) {
    std::string bytes = read(path());
    bytes[offset_of(page) + 20] ^= 4;
    if (page != last) bytes[offset_of(last) + 20] ^= 4;
    std::ofstream(damaged, std::ios::binary) << bytes;
    const Outcome outcome = clamor({"inspect", damaged, "--verify"});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_NE(outcome.err.find("bytes at " + std::to_string(offset_of(page)) + " "),
              std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.err.find("checksum"), std::string::npos) << outcome.err;
  }
}

TEST_F(InspectCommand, VerifyNamesThePageOfTheGeometryThatIsDamaged) {
  const Json page = Json::parse(shown({"--json", "--pages"}))["geometry_pages"][0];
  const std::string damaged = *folder_ / "damaged.clamor";
  std::string bytes = read(path());
  const auto offset = page["offset"].get<std::size_t>();
  bytes[offset + page["packed_bytes"].get<std::size_t>() - 1] ^= 1;
  std::ofstream(damaged, std::ios::binary) << bytes;
  const Outcome outcome = clamor({"inspect", damaged, "--verify"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("page 1 of 1 of the geometry"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("bytes at " + std::to_string(offset)), std::string::npos);
  EXPECT_EQ(clamor({"inspect", damaged}).code, 0);  // parts that are not needed are not read
}

TEST(BakeOverview, PutsACrowdInOneLine) {
  std::vector<Emitter> emitters(1003);
  for (std::size_t i = 0; i < 1000; ++i) {
    emitters[i].name = "fan #" + std::to_string(i);
    emitters[i].position_m = {static_cast<double>(i), 2, -static_cast<double>(i)};
  }
  emitters[1000].name = "fan #1000";
  emitters[1000].gain = 0.5;  // an emitter with another gain
  emitters[1001].name = "horn";
  emitters[1002].name = "4711";  // a name that is only a number
  const auto groups = groups_of(emitters);
  ASSERT_EQ(groups.size(), 4u);
  EXPECT_EQ(groups[0].name, "fan");
  EXPECT_EQ(groups[0].count, 1000u);
  EXPECT_EQ(groups[0].low_m, Vec3(0, 2, -999));
  EXPECT_EQ(groups[0].high_m, Vec3(999, 2, 0));
  EXPECT_EQ(groups[1].name, "fan #1000");
  EXPECT_EQ(groups[2].name, "horn");
  EXPECT_EQ(groups[3].name, "4711");
}

}  // namespace

}  // namespace clamor::testing
