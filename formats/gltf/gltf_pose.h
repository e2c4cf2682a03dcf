// gltf_pose.h: the rest pose of skinned meshes, and meshes by the default weights of their shape
// keys.
//
// glTF 2.0, 3.7.3.3: the transform of a skinned node itself is ignored; its vertices are
// placed by the world transforms of its joints times their inverse bind matrices. A shape key
// (morph target) moves vertices by its weight: that of the node, else that of the mesh.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "common/result.h"
#include "common/vec.h"
#include "formats/gltf/gltf_accessor.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

using JointMatrices = std::vector<glm::dmat4>;

// Moves the vertices of one primitive.
class PrimitivePose {
 public:
  // Nothing if a joint or an accessor is out of range. `vertex` must be below the number of
  // vertices with which the pose was opened.
  std::optional<Vec3> moved(std::size_t vertex, const Vec3& position) const;

 private:
  friend class GltfPose;
  std::vector<std::pair<double, GltfReader>> keys_;            // weight, moves
  std::vector<std::pair<GltfReader, GltfReader>> influences_;  // joints, weights, four at a time
  const JointMatrices* joints_ = nullptr;                      // null: no skin
};

class GltfPose {
 public:
  // Refers to the scene.
  explicit GltfPose(const GltfScene& scene);

  bool is_skinned(int node) const { return kind_[static_cast<std::size_t>(node)] & kSkinned; }
  bool has_keys(int node) const { return kind_[static_cast<std::size_t>(node)] & kKeyed; }
  bool moves(int node) const { return kind_[static_cast<std::size_t>(node)] != 0; }

  // The pose of a primitive of the node's mesh. The Error says what is wrong with skin or keys.
  Result<PrimitivePose> open(int node, std::size_t primitive);

 private:
  static constexpr unsigned char kSkinned = 1, kKeyed = 2;

  Result<const JointMatrices*> joints_of(std::size_t skin);
  glm::dmat4 world_of(std::size_t node) const;

  const GltfScene& scene_;
  std::vector<unsigned char> kind_;  // by node
  std::map<std::size_t, JointMatrices> joints_;
};

}  // namespace clamor
