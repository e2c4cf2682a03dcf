#include <cmath>

#include <gmock/gmock.h>

#include "formats/level/acoustic_values.h"
#include "formats/level/material_presets.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

class Materials : public LevelTest {
 protected:
  ImportedLevel with(json material, const ImportOptions& options = {}) {
    triangle();
    level_["materials"] = json::array({material});  // compilers differ on {material}
    level_["meshes"][0]["primitives"][0]["material"] = 0;
    auto imported = import(options);
    EXPECT_TRUE(imported.ok()) << (imported.ok() ? "" : imported.error().message);
    return imported.ok() ? *imported : ImportedLevel{};
  }
};

TEST_F(Materials, PreferTheSidecarAndReportWhatItReplaces) {
  write("level.acoustics.json", R"({"materials": {"brick": "curtain"}})");
  const json extension = {{"CLAMOR_materials_acoustic", {{"preset", "brick"}}}};
  const auto replaced = with({{"name", "Brick"}, {"extensions", extension}});
  EXPECT_EQ(replaced.report.materials.at(0).preset, "curtain");
  EXPECT_THAT(replaced.report.found,
              ::testing::Contains(HasSubstr("'Brick': the sidecar 'brick' replaces the level's "
                                            "own CLAMOR_materials_acoustic")));
  EXPECT_TRUE(
      replaced.report.warnings.empty() ||
      !::testing::Value(replaced.report.warnings, ::testing::Contains(HasSubstr("sidecar"))));
}

TEST_F(Materials, PreferTheSidecarToExtras) {
  write("level.acoustics.json", R"({"materials": {"*": "carpet"}})");
  const auto imported = with({{"name", "x"}, {"extras", {{"acoustic", {{"preset", "glass"}}}}}});
  EXPECT_EQ(imported.report.materials.at(0).preset, "carpet");
  EXPECT_EQ(imported.report.materials.at(0).how, "sidecar '*'");
}

TEST_F(Materials, PreferTheirExtensionToExtrasAndName) {
  const auto imported =
      with({{"name", "Brick"},
            {"extensions", {{"CLAMOR_materials_acoustic", {{"absorption", 0.25}, {"phong", 50}}}}},
            {"extras", {{"acoustic", "glass"}}}});
  const Material& material = imported.level.materials.at(0);
  EXPECT_EQ(material.absorption, same_in_all_bands(0.25f));
  EXPECT_EQ(material.phong, same_in_all_bands(50));
  EXPECT_EQ(material.scattering, same_in_all_bands(0)) << "an exponent alone is a mirror";
  EXPECT_EQ(imported.report.materials.at(0).how, "CLAMOR_materials_acoustic");
  EXPECT_NEAR(imported.report.materials.at(0).area_m2, 0.5, 1e-12);
}

TEST_F(Materials, PreferExtrasToTheirName) {
  const auto imported =
      with({{"name", "Brick"}, {"extras", {{"acoustic", {{"preset", "glass"}}}}}});
  EXPECT_EQ(imported.report.materials.at(0).preset, "glass");
  EXPECT_EQ(imported.report.materials.at(0).how, "extras");
}

TEST_F(Materials, AreMirrorsWithAnExponentThatIsLargeEnough) {
  for (const double exponent : {1e4, 5e4, 1e8}) {
    const auto imported = with(
        {{"name", "x"}, {"extras", {{"acoustic", {{"absorption", 0.1}, {"phong", exponent}}}}}});
    const Material& material = imported.level.materials.at(0);
    EXPECT_TRUE(is_mirror(material)) << exponent;
    EXPECT_EQ(material.phong, same_in_all_bands(kMirrorExponent)) << exponent;
  }
}

TEST_F(Materials, TakeFlatExtrasAsBlenderWritesThem) {
  const auto imported = with({{"name", "x"},
                              {"extras",
                               {{"acoustic_absorption", {0.1, 0.2, 0.3}},
                                {"acoustic_bandsHz", {125, 1000, 4000}},
                                {"somebody_elses", 1}}}});
  EXPECT_FLOAT_EQ(imported.level.materials.at(0).absorption[4], 0.2f);
  EXPECT_FLOAT_EQ(imported.level.materials.at(0).absorption[7], 0.3f);
}

TEST_F(Materials, HaveRowsOfSeatsWhereTheyAreGiven) {
  const json written = {{"preset", "audience"}, {"rows_m", 0.8}};
  const auto imported = with({{"name", "stalls"}, {"extras", {{"acoustic", written}}}});
  EXPECT_EQ(imported.level.materials.at(0).rows_m, 0.8f);
  const auto flat = with(
      {{"name", "stalls"}, {"extras", {{"acoustic_absorption", 0.5}, {"acoustic_rows_m", 1}}}});
  EXPECT_EQ(flat.level.materials.at(0).rows_m, 1);
  const auto without = with({{"name", "stalls"}, {"extras", {{"acoustic", "audience"}}}});
  EXPECT_EQ(without.level.materials.at(0).rows_m, 0);
}

TEST_F(Materials, HaveRowsOfSeatsByAPresetThatIsOtherwiseTheOneWithoutRows) {
  const MaterialPresets& presets = MaterialPresets::built_in();
  for (const auto& [with_rows, without] :
       {std::pair("audience_rows", "audience"), {"seats_rows", "seats_upholstered"}}) {
    const auto imported = with({{"name", "x"}, {"extras", {{"acoustic", with_rows}}}});
    const Material& rows = imported.level.materials.at(0);
    EXPECT_EQ(rows.rows_m, 0.8f);
    EXPECT_EQ(rows.absorption, presets.get(without)->absorption);
    EXPECT_EQ(rows.scattering, presets.get(without)->scattering);
  }
}

TEST_F(Materials, TransmitAtMostWhatTheyAbsorbWithAWarning) {
  const json written = {{"absorption", {0.1, 0.5}}, {"transmission", 0.3}, {"bandsHz", {63, 8000}}};
  const auto imported = with({{"name", "paper"}, {"extras", {{"acoustic", written}}}});
  const Material& material = imported.level.materials.at(0);
  EXPECT_TRUE(conserves_energy(material));
  EXPECT_EQ(material.transmission.front(), 0.1f);
  EXPECT_EQ(material.transmission.back(), 0.3f);
  EXPECT_THAT(imported.report.warnings,
              ::testing::Contains(HasSubstr("'paper' transmits more than it absorbs")));
}

TEST_F(Materials, PreferTheFirstMatchingPatternOfTheSidecarToTheirName) {
  write("level.acoustics.json",
        R"({"materials": {"wall_?": {"preset": "brick", "absorption": 0.5}, "*": "carpet"}})");
  const auto imported = with({{"name", "Wall_3"}});
  EXPECT_EQ(imported.report.materials.at(0).how, "sidecar 'wall_?'");
  EXPECT_EQ(imported.level.materials.at(0).name, "Wall_3");
  EXPECT_EQ(imported.level.materials.at(0).absorption, same_in_all_bands(0.5f));
  const auto brick = MaterialPresets::built_in().get("brick");
  EXPECT_EQ(imported.level.materials.at(0).scattering, brick->scattering);
}

TEST_F(Materials, AreGuessedFromTheirNames) {
  const MaterialPresets& presets = MaterialPresets::built_in();
  const std::pair<const char*, const char*> cases[] = {{"wall_brick", "brick"},
                                                       {"WallBrick.002", "brick"},
                                                       {"brick_wall", "brick"},
                                                       {"Concrete_Wall", "concrete"},
                                                       {"m_bath_glass_door", "glass"},
                                                       {"Wood_Floor_Light", "wood_floor"},
                                                       {"Carrera_Marble", "marble"},
                                                       {"black_tiles", "tile"},
                                                       {"Parquet", "wood_floor"},
                                                       {"rug", "carpet_thin"},
                                                       {"Metal_3", "metal"},
                                                       {"window", "glass"},
                                                       {"wooden_table", "wood"},
                                                       {"heavy curtains", "curtain"},
                                                       {"Crowd_07", "audience"},
                                                       {"Stalls_2", "audience_rows"},
                                                       {"seat rows left", "seats_rows"},
                                                       {"Beton", "concrete"},
                                                       {"ceiling_tile", "ceiling_tile"},
                                                       {"walls", "plaster"},
                                                       {"Floors", "concrete_smooth"},
                                                       {"ceiling", "plaster"},
                                                       {"arches", "stone"},
                                                       {"arcs_03", "stone"},
                                                       {"wooden_floors", "wood_floor"},
                                                       {"stone_wall", "stone"},
                                                       {"Curtains", "curtain"},
                                                       {"m_bath_ext_walls", "plaster"}};
  for (const auto& [name, preset] : cases) {
    EXPECT_EQ(presets.guess(name).preset, preset) << name;
    EXPECT_TRUE(presets.guess(name).is_sure()) << name;
  }
  for (const char* name : {"Material_002", "", "BoomBox_Mat", "object32", "wallet", "Ice_Cream"})
    EXPECT_EQ(presets.guess(name).preset, "") << name;
}

TEST_F(Materials, WhoseNamesTellOppositesGetTheDefaultAndAWarning) {
  const auto imported = with({{"name", "Concrete_Carpet"}});
  EXPECT_EQ(imported.report.materials.at(0).preset, "plaster");
  EXPECT_EQ(imported.report.materials.at(0).how, "doubt");
  EXPECT_THAT(imported.report.warnings,
              ::testing::Contains(::testing::AllOf(HasSubstr("'Concrete_Carpet'"),
                                                   HasSubstr("'concrete' or 'carpet'"),
                                                   HasSubstr("preset in the sidecar"))));
}

TEST_F(Materials, TransmitByTheirSoundReductionIndexIfTheyAreBuildingElements) {
  const MaterialPresets& presets = MaterialPresets::built_in();
  for (std::size_t i = 0; i < presets.names().size(); ++i) {
    const std::string& name = presets.names()[i];
    const Material material = *presets.get(name);
    EXPECT_TRUE(conserves_energy(material)) << name;
    EXPECT_EQ(presets.origin(i).reduction_db.has_value(),
              !presets.origin(i).reduction_source.empty())
        << name;
  }
  const auto reduction_db = [&](const char* name, std::size_t band) {
    return -10 * std::log10(presets.get(name)->transmission[band]);
  };
  for (const char* name : {"brick", "brick_painted", "concrete", "stone", "plaster"})
    for (std::size_t b = 1; b < kBandCount; ++b) {
      EXPECT_GE(reduction_db(name, b), 29.9) << name;
      EXPECT_LT(reduction_db(name, b), 80) << name;
    }
  for (const char* name : {"door", "glass", "glass_double", "plasterboard", "wood", "plywood"})
    for (std::size_t b = 3; b < kBandCount; ++b) {
      EXPECT_GT(reduction_db(name, b), 15) << name;
      EXPECT_LT(reduction_db(name, b), 50) << name;
    }
  EXPECT_NEAR(reduction_db("door", 4), 18, 0.01) << "as the table says";
  EXPECT_LT(reduction_db("curtain", 4), 10);
  EXPECT_EQ(presets.get("carpet")->transmission, Bands{}) << "what is below it is not known";
}

TEST_F(Materials, OfUnknownNamesGetTheDefaultAndAWarning) {
  const auto imported = with({{"name", "object32"}}, {.material = "stone"});
  EXPECT_EQ(imported.report.materials.at(0).preset, "stone");
  EXPECT_EQ(imported.report.materials.at(0).how, "default");
  EXPECT_THAT(imported.report.warnings, ::testing::Contains(HasSubstr("'stone'")));
}

TEST_F(Materials, AreImportedOnlyIfTrianglesUseThem) {
  const auto imported = with({{"name", "Brick"}});
  EXPECT_EQ(imported.level.materials.size(), 1u);
  level_["materials"].insert(level_["materials"].begin(), json{{"name", "unused"}});
  level_["meshes"][0]["primitives"][0]["material"] = 1;
  const Level again = level();
  EXPECT_EQ(again.materials.size(), 1u);
  EXPECT_EQ(again.mesh.materials.at(0), 0);
}

TEST_F(Materials, ThatAreMisspelledSuggestTheNearestName) {
  triangle();
  level_["materials"] = {{{"name", "x"}, {"extras", {{"acoustic", "plastr"}}}}};
  level_["meshes"][0]["primitives"][0]["material"] = 0;
  EXPECT_THAT(refusal(), ::testing::AllOf(HasSubstr("level.gltf"), HasSubstr("'plastr'"),
                                          HasSubstr("nearest name is 'plaster'")));
  EXPECT_THAT(refusal({.material = "bric"}), HasSubstr("'brick'"));
  EXPECT_THAT(refusal({.material = "velvet"}), HasSubstr("the preset for it is 'curtain'"));
}

TEST(AcousticValues, AreInterpretedByTheLengthOfTheirList) {
  const auto bands = [](std::vector<double> values) {
    const auto result = bands_from_values(values, {}, 0, 1000);
    EXPECT_TRUE(result.ok());
    return result.ok() ? *result : Bands{};
  };
  EXPECT_EQ(bands({7}), same_in_all_bands(7));
  // A list that is its own frequency in Hz comes back as the bands' frequencies.
  for (std::size_t count : {6u, 7u, 8u, 9u, 10u}) {
    std::vector<double> values;
    const double first = count <= 7 ? 125 : count == 8 ? 62.5 : 31.25;
    for (std::size_t i = 0; i < count; ++i) values.push_back(first * std::exp2(i) / 100);
    const Bands result = bands(values);
    for (std::size_t b = 1; b <= 6; ++b)
      EXPECT_NEAR(result[b], kBandCentres_hz[b] / 100, 1e-4) << count << " values, band " << b;
    EXPECT_NEAR(result[7], count == 6 ? 40 : 80, 1e-4);
  }
  // Steam Audio's: 400, 2500, 15000 Hz.
  const Bands three = bands({4, 25, 150});
  EXPECT_FLOAT_EQ(three[2], 4);
  EXPECT_FLOAT_EQ(three[4], 10);
  EXPECT_FLOAT_EQ(three[7], 80);
  for (std::size_t count : {0u, 2u, 4u, 5u, 11u})
    EXPECT_FALSE(bands_from_values(std::vector<double>(count, 0.5), {}, 0, 1).ok()) << count;
}

}  // namespace
}  // namespace clamor::testing
