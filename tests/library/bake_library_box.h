// bake_library_box.h: a box for tests of the bake's C interface, as a glTF file and as triangles.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bake/clamor_bake.h"
#include "formats/bake_file/bake_layout.h"
#include "tests/build_paths.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {

struct DestroysLevel {
  void operator()(clamor_bake_level* level) const { clamor_bake_destroy_level(level); }
};
using BakedLevel = std::unique_ptr<clamor_bake_level, DestroysLevel>;

inline clamor_bake_options few_photons() {
  clamor_bake_options options{};
  options.bytes = sizeof(options);
  options.photons = 1000;
  options.sources = 1000;
  return options;
}

inline std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline std::string in_memory(const BakedLevel& level, const clamor_bake_options& options) {
  void* bytes = nullptr;
  uint64_t count = 0;
  clamor_bake_error error;
  EXPECT_EQ(clamor_bake_to_memory(level.get(), &options, &bytes, &count, nullptr, &error),
            CLAMOR_BAKE_OK)
      << error.sentence;
  std::string copy(static_cast<const char*>(bytes), count);
  clamor_bake_free(bytes);
  return copy;
}

// Pages, sounds and triangles: all but the root, which also tells where the level came from.
inline std::string without_root(const std::string& file) {
  Preamble preamble;
  std::memcpy(&preamble, file.data(), sizeof(preamble));
  return file.substr(sizeof(preamble), preamble.root_offset - sizeof(preamble));
}

inline const std::vector<float> kCorners_m = {0, 0, 0, 6, 0, 0, 0, 3, 0, 6, 3, 0,
                                              0, 0, 8, 6, 0, 8, 0, 3, 8, 6, 3, 8};
inline const std::vector<uint32_t> kWalls = {0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3, 0, 4, 5, 0, 5, 1,
                                             2, 3, 7, 2, 7, 6, 0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5};

// A folder with a box in glTF, whose sidecar has two emitters.
class BakeLibraryTest : public LevelTest {
 protected:
  std::string box_file() {
    const int positions = floats(kCorners_m);
    const int indices = accessor(view(raw(kWalls)), 5125, kWalls.size(), "SCALAR");
    mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}, {"material", 0}});
    node({{"mesh", 0}});
    level_["materials"] = {{{"name", "mineral_wool"}}};
    write("box.acoustics.json",
          R"({"emitters": [{"name": "one", "signal": "noise", "at": [2, 1.5, 3], "gain": 0.5},
              {"name": "two", "signal": "tone.wav", "at": [4, 1, 6], "facing": [1, 0, 2],
               "directivity": 2, "random_delay": 1}]})");
    write("tone.wav", wav());
    return write("box.gltf", finished().dump());
  }

  BakedLevel read(const std::string& path, const clamor_bake_level_options* options = nullptr) {
    clamor_bake_level* level = nullptr;
    clamor_bake_error error;
    EXPECT_EQ(clamor_bake_read_level(path.c_str(), options, &level, &error), CLAMOR_BAKE_OK)
        << error.sentence;
    return BakedLevel(level);
  }

  // The triangles and the emitters of box_file() without its file.
  BakedLevel box_of_triangles() {
    clamor_bake_level* made = nullptr;
    EXPECT_EQ(clamor_bake_create_level("box.gltf", &made, nullptr), CLAMOR_BAKE_OK);
    BakedLevel level(made);
    clamor_bake_material mineral_wool{};
    mineral_wool.bytes = sizeof(mineral_wool);
    mineral_wool.preset = "mineral_wool";
    uint32_t material = 0;
    clamor_bake_error error;
    EXPECT_EQ(clamor_bake_add_material(made, &mineral_wool, &material, &error), CLAMOR_BAKE_OK)
        << error.sentence;
    EXPECT_EQ(
        clamor_bake_add_triangles(made, kCorners_m.data(), 8, kWalls.data(), 12, material, &error),
        CLAMOR_BAKE_OK)
        << error.sentence;
    clamor_bake_sound sound{};
    sound.bytes = sizeof(sound);
    sound.path = "noise";
    clamor_bake_emitter emitter{};
    emitter.bytes = sizeof(emitter);
    emitter.name = "one";
    emitter.position_m[0] = 2, emitter.position_m[1] = 1.5, emitter.position_m[2] = 3;
    emitter.gain = 0.5;
    EXPECT_EQ(clamor_bake_add_sound(made, &sound, &emitter.sound, &error), CLAMOR_BAKE_OK)
        << error.sentence;
    EXPECT_EQ(clamor_bake_add_emitter(made, &emitter, &error), CLAMOR_BAKE_OK) << error.sentence;
    return level;
  }

  // The file that the program writes with these words.
  std::string bytes_of_command(const std::string& level, const std::string& words) const {
    const std::string out = folder_ + "/command.clamor";
    const std::string command = std::string(kProgram) + " bake " + level + " -o " + out +
                                " --quiet --no-journal " + words + " 2>/dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return bytes_of(out);
  }

  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
};

}  // namespace clamor::testing
