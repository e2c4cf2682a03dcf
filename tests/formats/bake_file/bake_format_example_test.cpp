// bake_format_example_test.cpp: the worked example of bake_format.md is what the encoder writes.
#include <bit>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "formats/bake_file/page.h"
#include "formats/level/emitter.h"
#include "tests/build_paths.h"

namespace clamor {

namespace {

// Bytes of the lines of the specification that start with "page".
std::vector<std::byte> documented_page() {
  std::vector<std::byte> bytes;
  std::ifstream file(std::string(testing::kSourceDir) + "/formats/bake_format.md");
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("page ")) continue;
    std::istringstream words(line.substr(5, 49));
    for (std::string word; words >> word && word.size() == 2;)
      bytes.push_back(static_cast<std::byte>(std::stoi(word, nullptr, 16)));
  }
  return bytes;
}

TEST(BakeFormat, HasAnExampleThatTheEncoderReproduces) {
  // The -0 in the imported axis selects one of four encodings of -Z.
  const Emitter click{.name = "click", .position_m = {1, 1.5, -3}, .axis = {-0.0, 0, -1}};
  OctreeNode node;
  node.low_m = node.high_m = Vec3f(click.position_m);
  node.source_count = 1;
  Source source;
  set_from_emitter(source, click);
  source.u = std::bit_cast<float>(std::uint32_t{0x3f287b9e});

  const auto documented = documented_page();
  EXPECT_EQ(documented, encode_page(node, std::span(&source, 1), 8));

  const auto read = decode_page(node, documented, std::span(&click, 1), 0);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ((*read)[0].position_m, Vec3f(1, 1.5f, -3));
  EXPECT_TRUE((*read)[0].is_emitter);
  EXPECT_EQ((*read)[0].power, source.power);
}

}  // namespace

}  // namespace clamor
