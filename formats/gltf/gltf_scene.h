// gltf_scene.h: a glTF file as plain structs.
//
//   .gltf | .glb -> gltf_document -> gltf_check -> gltf_compression -> geometry, sounds
//
// All indices are in range and all buffer views lie inside their buffers; accessors are checked
// when they are opened (gltf_accessor.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "formats/files/json.h"
#include "formats/files/level_folder.h"

namespace clamor {

inline constexpr int kNone = -1;         // absent index
inline constexpr int kGltfFloat = 5126;  // component type

struct GltfView {
  int buffer = kNone;
  std::size_t offset = 0, length = 0;  // bytes in the buffer
  std::size_t stride = 0;              // 0 if tightly packed
};

struct GltfAccessor {
  int view = kNone;  // none if all elements are zero
  std::size_t offset = 0;
  int component_type = 0;  // 5120 to 5126
  int components = 1;
  std::size_t count = 0;
  bool normalized = false;
  double step = 0;  // of numbers in floating point that compression has rounded
  std::size_t sparse_count = 0;
  int sparse_index_view = kNone, sparse_index_type = 0, sparse_value_view = kNone;
  std::size_t sparse_index_offset = 0, sparse_value_offset = 0;
};

struct GltfPrimitive {
  int mode = 4;
  std::vector<std::pair<std::string, int>> attributes;  // accessors
  int indices = kNone;                                  // an accessor
  int material = kNone;

  // The accessor of an attribute, or kNone.
  int accessor(std::string_view attribute) const;
  int positions() const { return accessor("POSITION"); }
};

struct GltfMesh {
  std::string name;
  std::vector<GltfPrimitive> primitives;
};

struct GltfNode {
  std::string name;
  std::vector<int> children;
  int parent = kNone;
  int mesh = kNone;
  glm::dmat4 local{1.0};
};

struct GltfScene {
  std::vector<FileBytes> buffers;  // a fallback of compressed views may be empty
  std::vector<GltfView> views;
  std::vector<GltfAccessor> accessors;
  std::vector<GltfMesh> meshes;
  std::vector<GltfNode> nodes;
  std::vector<std::string> materials;  // names
  std::vector<int> roots;              // root nodes of the chosen scene
  std::optional<std::size_t> chosen;   // the scene; nothing if the file has none
  Json json;                           // whole document, for extensions and extras
  Vec3 origin_m{};                     // of the level; placements are relative to it

  std::size_t bytes() const;  // total size of all buffers, which limits allocations
  // The bytes of a view; nothing if its buffer is a fallback that is not there.
  std::optional<std::span<const std::byte>> bytes_of(const GltfView& view) const;
};

// The transform of a node or instance: a translation, a quaternion x, y, z, w, and scales. Each may
// be empty.
glm::dmat4 transform_of(std::span<const double> move, std::span<const double> turn,
                        std::span<const double> scale);

}  // namespace clamor
