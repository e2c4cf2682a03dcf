#include "runtime/sampling/moving_script.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>

#include <gtest/gtest.h>
#include <unistd.h>

#include "formats/audio/audio_file.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "tests/runtime/moving_field.h"

namespace clamor {
namespace {

using testing::heard;

std::string written(const std::string& text) {
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("clamor_moving_" + std::to_string(::getpid()) + ".json"))
                               .string();
  std::ofstream(path) << text;
  return path;
}

TEST(MovingScript, MovesItsSourcesLikeACaller) {
  const std::string path = written(R"({ "sources": [
      { "name": "car", "signal": "noise", "gain_db": -6.0206, "from_s": 0.2, "until_s": 0.6,
        "path": { "points": [ { "time_s": 0, "position_m": [-10, 0, -5] },
                              { "time_s": 1, "position_m": [20, 0, -5] } ] } } ] })");
  auto script = MovingScript::read(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(script.ok()) << script.error().message;
  AuralizerOptions options;
  options.moving = script->options(0);
  ASSERT_EQ(options.moving.signals.size(), 1u);
  const auto by_hand = Auralizer::create(AuralizerInput{}, options);
  options.script = std::make_shared<MovingScript>(std::move(*script));
  const auto by_script = Auralizer::create(AuralizerInput{}, options);
  ASSERT_TRUE(by_hand.ok() && by_script.ok());
  MovingSources& moving = *(*by_hand)->moving();
  EXPECT_EQ((*by_script)->moving(), nullptr) << "the sources of a script are private";
  std::optional<MovingHandle> car;
  const auto expected = heard(**by_hand, 1, [&](double t) {
    MovingSource source;
    source.position_m = {-10 + 30 * t, 0, -5};
    source.velocity_mps = {30, 0, 0};
    source.gain = same_in_all_bands(0.5f);
    source.start_s = 0.2;
    if (t >= 0.2 && !car) car = *moving.add(source);
    if (car && t < 0.6) (void)moving.move(*car, source.position_m, {30, 0, 0});
    if (car && t >= 0.6) (void)moving.remove(*car);
    moving.commit(t);
  });
  const auto scripted = heard(**by_script, 1, [](double) {});
  float peak = 0, difference = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    peak = std::max(peak, std::abs(expected[i]));
    difference = std::max(difference, std::abs(expected[i] - scripted[i]));
  }
  EXPECT_GT(peak, 0.01f);
  EXPECT_LT(difference, 1e-4f * peak);
  EXPECT_EQ(scripted.front(), 0);
  EXPECT_LT(std::abs(scripted.back()), 1e-6f);
}

TEST(MovingScript, NamesTheErrorInAFile) {
  const std::string path = written(R"({ "sources": [ { "signl": "noise", "path": {} } ] })");
  const auto script = MovingScript::read(path);
  std::filesystem::remove(path);
  ASSERT_FALSE(script.ok());
  EXPECT_NE(script.error().message.find("signl"), std::string::npos) << script.error().message;
  EXPECT_NE(script.error().message.find("source 1"), std::string::npos) << script.error().message;
}

TEST(MovingScript, RefusesASourceThatEndsBeforeItBegins) {
  const std::string path = written(R"({ "sources": [ { "from_s": 5, "until_s": 2, "path": {
      "points": [ { "time_s": 0, "position_m": [0, 1, 0] } ] } } ] })");
  const auto script = MovingScript::read(path);
  std::filesystem::remove(path);
  ASSERT_FALSE(script.ok());
  EXPECT_NE(script.error().message.find("'until_s'"), std::string::npos) << script.error().message;
}

// A script from elsewhere must not be able to open arbitrary files as sounds.
TEST(MovingScript, ReadsOnlySoundsInItsOwnFolder) {
  const std::filesystem::path root =
      std::filesystem::temp_directory_path() / ("clamor_script_" + std::to_string(::getpid()));
  std::filesystem::create_directories(root / "game" / "sounds");
  const auto flac = encode_flac(std::vector<float>(100, 0.5f));
  ASSERT_TRUE(flac.ok());
  for (const auto* file : {"secret.flac", "game/sounds/car.flac"})
    std::ofstream(root / file, std::ios::binary)
        .write(reinterpret_cast<const char*>(flac->data()),
               static_cast<std::streamsize>(flac->size()));
  std::filesystem::create_symlink(root / "secret.flac", root / "game" / "link.flac");
  const auto read = [&](const std::string& signal) {
    std::ofstream(root / "game" / "script.json")
        << R"({ "sources": [ { "signal": ")" << signal
        << R"(", "path": { "points": [ { "time_s": 0, "position_m": [0, 0, 0] } ] } } ] })";
    return MovingScript::read((root / "game" / "script.json").string());
  };
  const auto inside = read("sounds/car.flac");
  EXPECT_TRUE(inside.ok()) << inside.error().message;
  for (const std::string& outside :
       {std::string("../secret.flac"), (root / "secret.flac").string(),
        std::string("sounds/../../secret.flac"), std::string("link.flac"),
        "file://" + (root / "secret.flac").string()}) {
    const auto script = read(outside);
    ASSERT_FALSE(script.ok()) << outside;
    EXPECT_NE(script.error().message.find("leads out"), std::string::npos)
        << script.error().message;
  }
  std::filesystem::remove_all(root);
}

}  // namespace
}  // namespace clamor
