// assets_test.cpp: the levels we ship are there, are small, and hold what they promise.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/build_paths.h"

namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

const fs::path kAssets = fs::path(clamor::testing::kSourceDir) / "assets";

// The JSON chunk of a .glb: after 12 bytes of header, a length, the type and the text.
Json json_of_glb(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (bytes.size() < 20 || bytes.compare(0, 4, "glTF") != 0) return {};
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 12, sizeof length);
  if (length > bytes.size() - 20) return {};
  return Json::parse(bytes.substr(20, length), nullptr, false);
}

// glTF refers to things by their place in a list.
const Json& at_index(const Json& list, const Json& index) {
  return list.at(index.get<std::size_t>());
}

TEST(Assets, StayUnder8MegabytesInGit) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kAssets))
    if (entry.is_regular_file()) bytes += entry.file_size();
  EXPECT_GT(bytes, 1'000'000u);
  EXPECT_LT(bytes, 8'000'000u);
}

struct Crowd {
  std::size_t fans = 0;
  std::set<std::string> sounds;
  double latest_block_s = 0;  // latest start of a block
};

Crowd crowd_of(const char* name) {
  Crowd crowd;
  const Json level = json_of_glb(kAssets / "levels" / name);
  EXPECT_TRUE(level.is_object());
  const Json& audio = level.at("extensions").at("KHR_audio_emitter");
  for (const Json& node : level.at("nodes")) {
    const Json extensions = node.value("extensions", Json::object());
    if (!extensions.contains("EXT_mesh_gpu_instancing")) continue;
    const Json& attributes = extensions.at("EXT_mesh_gpu_instancing").at("attributes");
    const std::size_t count =
        at_index(level.at("accessors"), attributes.at("TRANSLATION")).at("count");
    for (const char* attribute : {"ROTATION", "SCALE", "_DELAY_S"})
      EXPECT_EQ(at_index(level.at("accessors"), attributes.at(attribute)).at("count"), count);
    crowd.fans += count;

    const Json& emitter =
        at_index(audio.at("emitters"), extensions.at("KHR_audio_emitter").at("emitters").at(0));
    const Json& source = at_index(audio.at("sources"), emitter.at("sources").at(0));
    EXPECT_TRUE(source.at("loop"));
    crowd.sounds.insert(at_index(audio.at("audio"), source.at("audio")).at("uri"));
    crowd.latest_block_s =
        std::max<double>(crowd.latest_block_s, extensions.at("CLAMOR_emitter").at("delay_s"));
    EXPECT_EQ(emitter.at("extensions").at("CLAMOR_emitter").at("directivity").size(), 8u);
  }
  return crowd;
}

TEST(Stadium, OfThePaperHas16416FansWithThirteenSoundsThatStartWithin300Milliseconds) {
  const Crowd crowd = crowd_of("stadium_paper.glb");
  EXPECT_EQ(crowd.fans, 16416u);
  EXPECT_EQ(crowd.sounds.size(), 13u);
  EXPECT_LE(crowd.latest_block_s, 0.1);  // fans of a block start within 0.2 s
}

TEST(Stadium, Has16416FansWithThreeTakesAndMoreOfThirteenKindsOfSoundThatStartAnywhere) {
  const Crowd crowd = crowd_of("stadium.glb");
  EXPECT_EQ(crowd.fans, 16416u);
  std::map<std::string, int> takes;
  for (const std::string& sound : crowd.sounds) ++takes[sound.substr(0, sound.rfind('_'))];
  EXPECT_EQ(takes.size(), 13u);
  for (const auto& [kind, count] : takes) EXPECT_GE(count, 3) << kind;
  EXPECT_GT(crowd.latest_block_s, 5);
}

TEST(Stadium, IsMadeOfBlocksOfSixKindsWithTheSameFansInTheSameSeats) {
  const Json level = json_of_glb(kAssets / "levels" / "stadium.glb");
  ASSERT_TRUE(level.is_object());
  std::map<std::vector<int>, std::set<std::vector<int>>> songs_of_kind;  // emitters of each block
  std::map<std::vector<int>, int> blocks_of_kind;
  const Json& nodes = level.at("nodes");
  for (const Json& node : nodes) {
    const std::string name = node.at("name");
    if (!node.contains("children") || !(name.starts_with("lower ") || name.starts_with("upper ")))
      continue;
    std::vector<int> places, emitters;
    for (const Json& child : node.at("children")) {
      const Json& extensions = at_index(nodes, child).at("extensions");
      places.push_back(extensions.at("EXT_mesh_gpu_instancing").at("attributes").at("TRANSLATION"));
      emitters.push_back(extensions.at("KHR_audio_emitter").at("emitters").at(0));
    }
    ++blocks_of_kind[places];
    songs_of_kind[places].insert(emitters);
  }
  int blocks = 0;
  for (const auto& [kind, count] : blocks_of_kind) blocks += count;
  EXPECT_EQ(blocks, 56);
  EXPECT_EQ(blocks_of_kind.size(), 6u);
  for (const auto& [kind, songs] : songs_of_kind) EXPECT_GT(songs.size(), 2u);
}

TEST(ViolinRoom, HasOneViolinThatBecomesMoreDirectionalWithFrequency) {
  const Json level = json_of_glb(kAssets / "levels" / "violin_room.glb");
  ASSERT_TRUE(level.is_object());
  std::size_t emitters = 0, chairs = 0;
  for (const Json& node : level.at("nodes")) {
    chairs += node.at("name").get<std::string>().starts_with("chair_");
    const Json extensions = node.value("extensions", Json::object());
    if (!extensions.contains("KHR_audio_emitter")) continue;
    ++emitters;
    const Json& directivity = extensions.at("CLAMOR_emitter").at("directivity");
    for (std::size_t band = 1; band < directivity.size(); ++band)
      EXPECT_GE(directivity.at(band), directivity.at(band - 1));
  }
  EXPECT_EQ(emitters, 1u);
  EXPECT_EQ(chairs, 40u);
}

TEST(ConcertHall, HasAboutAThousandTrianglesThatScatterATenth) {
  const Json level = json_of_glb(kAssets / "levels" / "concert_hall.glb");
  ASSERT_TRUE(level.is_object());
  std::size_t triangles = 0;
  for (const Json& mesh : level.at("meshes"))
    for (const Json& part : mesh.at("primitives"))
      triangles +=
          at_index(level.at("accessors"), part.at("indices")).at("count").get<std::size_t>() / 3;
  EXPECT_GT(triangles, 1000u);
  EXPECT_LT(triangles, 1500u);
  for (const Json& material : level.at("materials"))
    for (const double share :
         material.at("extensions").at("CLAMOR_materials_acoustic").at("scattering"))
      EXPECT_NEAR(share, 0.1, 1e-6);
}

TEST(Levels, AreCompleteOnDiskAndSayHowEverySurfaceSounds) {
  for (const char* name :
       {"stadium.glb", "stadium_paper.glb", "violin_room.glb", "concert_hall.glb"}) {
    const fs::path folder = kAssets / "levels";
    const Json level = json_of_glb(folder / name);
    ASSERT_TRUE(level.is_object()) << name;
    for (const Json& audio : level.at("extensions").at("KHR_audio_emitter").at("audio"))
      EXPECT_TRUE(fs::exists(folder / audio.at("uri").get<std::string>())) << audio;
    const Json presets = Json::parse(std::ifstream(kAssets / "materials.json")).at("materials");
    for (const Json& material : level.at("materials")) {
      const Json& acoustic = material.at("extensions").at("CLAMOR_materials_acoustic");
      if (acoustic.contains("preset"))
        EXPECT_TRUE(presets.contains(acoustic.at("preset").get<std::string>())) << material;
      else
        EXPECT_EQ(acoustic.at("absorption").size(), 8u) << material;
    }
    std::set<std::string> used;
    for (const Json& extension : level.at("extensionsUsed")) used.insert(extension);
    EXPECT_TRUE(used.contains("KHR_audio_emitter")) << name;
    EXPECT_TRUE(used.contains("CLAMOR_emitter")) << name;
    EXPECT_TRUE(used.contains("CLAMOR_materials_acoustic")) << name;
  }
}

}  // namespace
