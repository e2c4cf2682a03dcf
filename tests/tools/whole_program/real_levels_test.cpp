// Tests the whole program (bake, inspect, render, impulse) on levels from other sources.
#include <algorithm>
#include <cmath>
#include <ostream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/audio/audio_file.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;

struct RealLevel {
  const char* file;
  const char* emitter_at;  // somewhere inside
  const char* listener;
  double max_escaped;  // share of photons
};

// Prints the test parameter, whose default form would hold the addresses of the strings.
void PrintTo(const RealLevel& level, std::ostream* out) { *out << level.file; }

class RealLevels : public ::testing::TestWithParam<RealLevel> {};

TEST_P(RealLevels, BakeInspectRenderAndMeasureSanely_NoAsan) {
  const RealLevel& level = GetParam();
  const std::string path = testing::shared_level(level.file);
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "not on this machine: " << level.file;
  const Folder folder;
  const std::string bake = folder / "level.clamor", wav = folder / "out.wav";
  constexpr int kPhotons = 300;
  // The shoebox's "wall" would be plastered brick by its name, through which photons leave.
  const std::string acoustics =
      folder.write("opaque.json", R"({"materials": {"wall": {"absorption": 0.05}}})");

  const auto baked = clamor({"bake", path, "-o", bake, "--acoustics", acoustics, "--photons",
                             std::to_string(kPhotons), "--emitter",
                             std::string("name=try,signal=noise,at=") + level.emitter_at});
  ASSERT_EQ(baked.code, 0) << baked.err;

  const auto inspected = clamor({"inspect", bake, "--json"});
  ASSERT_EQ(inspected.code, 0) << inspected.err;
  const auto json = nlohmann::json::parse(inspected.out);
  // The boom box is the housing of its own emitters, which does not hold their sound back: with it
  // left out, nothing reflects.
  const bool has_surfaces = level.file != std::string("boom_box/boom_box.gltf");
  EXPECT_EQ(json["photons"]["traced"], has_surfaces ? kPhotons : 0);
  EXPECT_GE(json["sources"]["emitters"], 1);
  if (has_surfaces) {
    EXPECT_GT(json["sources"]["secondary"], kPhotons / 10);
  }
  EXPECT_LE(json["photons"]["escaped_share"], level.max_escaped) << level.file;
  EXPECT_EQ(json["bytes"]["file"], std::filesystem::file_size(bake));

  const auto rendered =
      clamor({"render", bake, "--receivers", "omni", "-o", wav, "--listener", level.listener,
              "--seconds", "1", "--voices", "500", "--gain", "-12dB"});
  ASSERT_EQ(rendered.code, 0) << rendered.err;
  const auto samples = read_audio(wav);
  ASSERT_TRUE(samples.ok());
  EXPECT_EQ(samples->size(), 48000u);
  double energy = 0;
  float peak = 0;
  for (const float sample : *samples) {
    ASSERT_TRUE(std::isfinite(sample));
    energy += static_cast<double>(sample) * sample;
    peak = std::max(peak, std::abs(sample));
  }
  EXPECT_GT(10 * std::log10(energy / 48000), -80.0);  // dBFS: not silent
  EXPECT_LT(peak, 1.0f);                              // not clipped

  const auto measured =
      clamor({"impulse", bake, "--listener", level.listener, "--strategy", "priority", "--json"});
  ASSERT_EQ(measured.code, 0) << measured.err;
  const auto parameters = nlohmann::json::parse(measured.out);
  EXPECT_EQ(parameters["bands_hz"].size(), 8u);
  for (const auto& g_db : parameters["energy"]["g_db"])
    EXPECT_TRUE(std::isfinite(g_db.get<double>()));
}

INSTANTIATE_TEST_SUITE_P(
    All, RealLevels,
    ::testing::Values(RealLevel{"sibenik.glb", "-10,-10,0", "5,-12,1",
                                0.8},  // no floor beside the altar
                      RealLevel{"sponza.glb", "0,2,0", "5,2,1", 1.0},
                      RealLevel{"stadium.glb", "0,2,0", "10,2,10", 1.0},
                      RealLevel{"bathroom.glb", "0,0.2,0", "0.3,0.2,0.4", 1.0},
                      RealLevel{"sampleroom.gltf", "-0.53,1,-0.53", "1,1,1", 1.0},
                      RealLevel{"shoebox_5x4x3.glb", "1.3,1.7,1.1", "3.9,2.4,1.6", 0.0},
                      RealLevel{"boom_box/boom_box.gltf", "0,1,0", "0.5,1,0.5", 1.0}),
    [](const auto& level) {
      std::string name = level.param.file;
      std::replace_if(
          name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
      return name;
    });

}  // namespace
}  // namespace clamor
