// box_level.h: levels of boxes, in a temporary folder.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tests/formats/level_builder.h"

namespace clamor::testing {

using Corner = std::array<float, 3>;

class BoxLevelTest : public LevelTest {
 protected:
  // Adds a mesh of 12 triangles, whose faces point outwards.
  int box_mesh(const Corner& low, const Corner& high, const std::string& name = "",
               int material = -1) {
    std::vector<float> positions;
    for (int corner = 0; corner < 8; ++corner)
      for (std::size_t axis = 0; axis < 3; ++axis)
        positions.push_back((corner >> axis & 1) != 0 ? high[axis] : low[axis]);
    const std::vector<std::uint16_t> indices = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6,
                                                0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7,
                                                0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    json primitive = {{"attributes", {{"POSITION", floats(positions)}}},
                      {"indices", accessor(view(raw(indices)), 5123, indices.size(), "SCALAR")}};
    if (material >= 0) primitive["material"] = material;
    const int index = mesh(primitive);
    level_["meshes"].back()["name"] = name;
    return index;
  }
  // Adds a box on a node.
  int box(const std::string& node_name, const Corner& low = {0, 0, 0},
          const Corner& high = {4, 3, 5}, int material = -1) {
    const int mesh = box_mesh(low, high, "", material);
    return node({{"mesh", mesh}, {"name", node_name}});
  }
  int material(json content) {
    level_["materials"].push_back(std::move(content));
    return static_cast<int>(level_["materials"].size()) - 1;
  }
  // Boxes among the surfaces of the level.
  std::size_t boxes(const ImportOptions& options = {}) const {
    return level(options).mesh.triangles.size() / 12;
  }
};

}  // namespace clamor::testing
