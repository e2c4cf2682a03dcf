// Tests that a room is set beside what was measured in it: one whose figures are known, and a real
// one, whose data lie beside the repository and may be absent.
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/box_level.h"
#include "tests/shell.h"
#include "tests/tools/drawn_page.h"

namespace clamor::testing {
namespace {

// Rows of a table in which these columns have these values.
nlohmann::json rows_of(const nlohmann::json& table, const nlohmann::json& with) {
  nlohmann::json found = nlohmann::json::array();
  for (const auto& row : table) {
    bool matches = true;
    for (const auto& [column, value] : with.items()) matches = matches && row[column] == value;
    if (matches) found.push_back(row);
  }
  return found;
}

class RoomExperiment : public ::testing::Test {
 protected:
  nlohmann::json tables_of(const std::string& room) const {
    const Outcome run = clamor({"experiment", "room", room, "-o", folder_ / "report", "--quick"});
    EXPECT_EQ(run.code, 0) << run.err;
    if (run.code != 0) return {};
    return nlohmann::json::parse(read(folder_ / "report/room.json"))["tables"];
  }

  const Folder folder_;
};

// Two figures at one pair, and what another program found; the walls in thirds, whose mean is 0.3.
constexpr const char* kBox = R"({
  "level": "box.gltf", "air": {"temperature_c": 20, "humidity_percent": 50},
  "materials": {"walls": {"bandsHz": [800, 1000, 1250], "absorption": [0.1, 0.2, 0.6],
                          "scattering": [1, 1, 1]}},
  "sources": [{"name": "S", "at": [1, 1.2, 1], "facing": [0, 0, 1], "directivity": 1}],
  "receivers": [{"name": "A", "at": [3, 1.7, 4]}, {"name": "B", "at": [3, 1.5, 2]}],
  "measured": [
    {"source": "S", "receiver": "A", "bandsHz": [800, 1000, 1250], "t30_s": [0.2, 0.3, 0.4]},
    {"receiver": "B", "bandsHz": [1000], "t30_s": [0.4]},
    {"by": "another", "bandsHz": [1000], "t30_s": [0.42]}]})";

TEST_F(RoomExperiment, ComparesMeansAndPairsInJustNoticeableDifferences) {
  level_of(folder_, box({4, 3, 5}), R"(, "materials": [{"name": "walls"}])", R"(, "material": 0)");
  const auto tables = tables_of(folder_.write("box.room.json", kBox));
  const auto mean = [&](const char* figure) {
    const auto rows = rows_of(tables["means"], {{"parameter", "T30"}, {"figure", figure}});
    EXPECT_EQ(rows.size(), 1u) << figure;
    return rows[0]["1000_hz"].get<double>();
  };
  EXPECT_NEAR(mean("measured (s)"), 0.35, 1e-9);
  // JNDs have two digits after the point, seconds three.
  EXPECT_NEAR(mean("another - measured (JND)"), (0.42 - 0.35) / (0.05 * 0.35), 0.005);
  // Two values of 0.3 and 0.4 deviate by 0.1 / sqrt(2).
  EXPECT_NEAR(mean("pairs measured (JND)"), 0.1 / std::sqrt(2) / (0.05 * 0.35), 0.005);
  const double ours = mean("Clamor (s)");
  EXPECT_NEAR(mean("Clamor - measured (JND)"), (ours - 0.35) / (0.05 * 0.35),
              0.005 + 0.0005 / (0.05 * 0.35));
  // Eyring's formula with 0.3, 94 m2 and 60 m3, of which 343 m/s makes 0.161 s/m; unequal path
  // lengths make the decay some per cent longer. The absorption at 1 kHz alone would give 0.46 s.
  EXPECT_NEAR(ours, 0.161 * 60 / (-std::log(0.7) * 94), 0.03);
  // Nothing was measured there.
  EXPECT_EQ(rows_of(tables["means"], {{"parameter", "T30"}})[0]["500_hz"], "");
  EXPECT_EQ(rows_of(tables["means"], {{"parameter", "C80"}}).size(), 0u);
  // Every pair has Clamor's figures with their spread, and what was measured there.
  EXPECT_EQ(rows_of(tables["pairs"], {{"pair", "S A"}, {"parameter", "C80"}}).size(), 2u);
  EXPECT_EQ(rows_of(tables["pairs"], {{"pair", "S B"}, {"figure", "measured (s)"}})[0]["1000_hz"],
            0.4);
  if (!has_node()) GTEST_SKIP() << "the page was not drawn; not on this machine: node";
  EXPECT_NE(drawn(folder_ / "report/room.html").find("<svg"), std::string::npos);
}

TEST_F(RoomExperiment, NamesWhatIsWrongWithADescription) {
  level_of(folder_, box({4, 3, 5}), R"(, "materials": [{"name": "walls"}])", R"(, "material": 0)");
  for (const auto& [from, to, says] :
       {std::tuple("\"walls\"", "\"wals\"", "no material 'wals'; the nearest name is 'walls'"),
        std::tuple("\"t30_s\": [0.4]", "\"t30_s\": [0.4, 1]", "measured 2: 't30_s' must have"),
        std::tuple("\"t30_s\": [0.4]", "\"t30_s\": [0]",
                   "measured 2: 't30_s' must have values from 0.001 to 100"),
        std::tuple("\"t30_s\": [0.4]", "\"d50\": [55]",
                   "measured 2: 'd50' must have values from 0 to 1"),
        std::tuple("\"name\": \"B\"", "\"name\": \"A\"",
                   "receivers 2 has the name of another; give each its own"),
        std::tuple("\"receiver\": \"B\"", "\"receiver\": \"C\"", "measured 2: names a source or"),
        std::tuple("\"bandsHz\": [1000], \"t30_s\": [0.4]", "\"t30\": [1]", "'t30'"),
        std::tuple("box.gltf", "none.gltf", "none.gltf")}) {
    std::string text = kBox;
    text.replace(text.find(from), std::string(from).size(), to);
    const Outcome run = clamor({"experiment", "room", folder_.write("box.room.json", text), "-o",
                                folder_ / "report", "--quick"});
    EXPECT_EQ(run.code, 1);
    EXPECT_NE(run.err.find(says), std::string::npos) << run.err;
  }
}

// Writes the seminar room CR2 of BRAS into a folder, or tells why not.
std::string write_bras_cr2(const Folder& folder) {
  const std::string data = std::string(kSourceDir) + "/../shared/rooms/bras_cr2";
  if (!std::filesystem::exists(data)) return data;
  if (!has("python3")) return "python3";
  run("python3 '" + std::string(kSourceDir) + "/tests/tools/experiments/bras_cr2.py' '" + data +
      "' '" + folder.path() + "'");
  return "";
}

// The page of bake shows the figures of the default size: up to 2.7 just-noticeable differences in
// decay times, and one in C80 and D50. This bake has a tenth of the sources, and its means vary
// with the seed by up to 1.1 and 0.3 of them.
TEST_F(RoomExperiment, MeasuresTheSeminarRoomOfBras) {
  if (const auto lacks = write_bras_cr2(folder_); !lacks.empty())
    GTEST_SKIP() << "not on this machine: " << lacks;
  const auto tables = tables_of(folder_ / "cr2.room.json");
  for (const auto& [parameter, most] : std::initializer_list<std::pair<const char*, double>>{
           {"EDT", 4.5}, {"T20", 4}, {"C80", 1.5}, {"D50", 1.5}}) {
    const auto row =
        rows_of(tables["means"], {{"parameter", parameter}, {"figure", "Clamor - measured (JND)"}});
    ASSERT_EQ(row.size(), 1u) << parameter;
    for (const char* const octave : {"250_hz", "500_hz", "1000_hz", "2000_hz", "4000_hz"})
      EXPECT_LT(std::abs(row[0][octave].get<double>()), most) << parameter << " " << octave;
  }
  EXPECT_EQ(rows_of(tables["pairs"], {{"parameter", "G"}}).size(), 20u);
}

// From the names of its materials alone. The bakes vary as above.
TEST_F(RoomExperiment, HasTheDecayOfTheSeminarRoomWhereAbsorptionIsFittedToIt) {
  if (const auto lacks = write_bras_cr2(folder_); !lacks.empty())
    GTEST_SKIP() << "not on this machine: " << lacks;
  const Outcome fit =
      clamor({"bake", folder_ / "cr2.gltf", "--acoustics", folder_ / "cr2.start.json", "--measured",
              folder_ / "cr2.measured.json", "-o", folder_ / "cr2.acoustics.json"});
  ASSERT_EQ(fit.code, 0) << fit.err;
  const auto row = rows_of(tables_of(folder_ / "cr2.named.room.json")["means"],
                           {{"parameter", "T20"}, {"figure", "Clamor - measured (JND)"}});
  ASSERT_EQ(row.size(), 1u);
  for (const char* const octave : {"250_hz", "500_hz", "1000_hz", "2000_hz", "4000_hz"})
    EXPECT_LT(std::abs(row[0][octave].get<double>()), 2) << octave;
}

}  // namespace
}  // namespace clamor::testing
