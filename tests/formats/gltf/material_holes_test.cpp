#include "formats/gltf/material_holes.h"

#include <gmock/gmock.h>

#include "formats/gltf/texture_colour.h"
#include "formats/level/material_presets.h"
#include "tests/formats/box_level.h"

namespace clamor::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// A PNG file of four pixels, three of them fully transparent.
constexpr const char* kQuarterOpaque =
    "data:image/"
    "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAYAAABytg0kAAAAEElEQVR42mM4ceLEfwZkAAAzh"
    "ANYwcKBXgAAAABJRU5ErkJggg==";

class Holes : public BoxLevelTest {
 protected:
  // A fence of a material with a texture, and a solid floor.
  void fence(json changes, const std::string& image = kQuarterOpaque) {
    json content = {{"name", "Metal"},
                    {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}};
    content.update(changes);
    level_["images"] = json::array({{{"uri", image}}});
    level_["textures"] = json::array({{{"source", 0}}});
    box("Fence", {0, 0, 0}, {4, 2, 0}, material(std::move(content)));
    box("Floor", {0, 0, 0}, {9, 0, 9});
  }
  Material of_fence() { return level().materials.at(0); }
};

#define SKIP_WITHOUT_DECODER()                          \
  if (!texture_means(*decode_data_uri(kQuarterOpaque))) \
  GTEST_SKIP() << "this tinygltf decodes no images"

TEST_F(Holes, OfAMaskPassSound) {
  SKIP_WITHOUT_DECODER();
  fence({{"alphaMode", "MASK"}});
  const Material solid = *MaterialPresets::built_in().get("metal"), open = of_fence();
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_NEAR(open.transmission[b], 0.75 + 0.25 * solid.transmission[b], 1e-6);
    EXPECT_NEAR(1 - open.absorption[b], 0.25 * (1 - solid.absorption[b]), 1e-6)
        << "a quarter of the area reflects";
  }
  EXPECT_THAT(import()->report.found, Contains(HasSubstr("'Metal' is alpha-masked, 75 % open")));
}

TEST_F(Holes, OfABlendedTextureAreItsFullyTransparentPixels) {
  SKIP_WITHOUT_DECODER();
  fence({{"alphaMode", "BLEND"}});
  EXPECT_NEAR(of_fence().transmission[4], 0.75, 0.05);
}

TEST_F(Holes, AreNoneInOpaqueMaterials) {
  fence({{"alphaMode", "OPAQUE"}});
  EXPECT_LT(of_fence().transmission[4], 0.05);
}

TEST_F(Holes, AreNoneInAPaneOfGlass) {
  json pane = {{"name", "Window glass"},
               {"alphaMode", "BLEND"},
               {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.2}}}}};
  box("Pane", {0, 0, 0}, {1, 1, 0}, material(std::move(pane)));
  EXPECT_LT(level().materials.at(0).transmission[4], 0.05);
  EXPECT_THAT(import()->report.warnings, Not(Contains(HasSubstr("glass"))));
}

TEST_F(Holes, DoNotChangeValuesThatWereWritten) {
  SKIP_WITHOUT_DECODER();
  fence({{"alphaMode", "MASK"}});
  write("level.acoustics.json", R"({"materials": {"Met*": {"absorption": 0.5}}})");
  EXPECT_EQ(of_fence().transmission[4], 0);
  EXPECT_THAT(import()->report.found, Contains(HasSubstr("75 % open, but has acoustic values")));
}

TEST_F(Holes, OfAnUnreadableTextureAreAskedForWithTheSidecarsLine) {
  fence({{"alphaMode", "MASK"}}, "data:image/ktx2;base64,q0tUWCAyMLsNChoK");
  level_["textures"] = {{{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}}};
  EXPECT_LT(of_fence().transmission[4], 0.05);
  EXPECT_THAT(import()->report.warnings,
              Contains(HasSubstr(R"("materials": { "Metal": { "preset": "metal")")));
  level_["images"][0]["uri"] = "missing.png";
  EXPECT_THAT(import()->report.warnings, Contains(HasSubstr("its texture cannot be read")));
}

}  // namespace
}  // namespace clamor::testing
