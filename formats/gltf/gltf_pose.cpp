#include "formats/gltf/gltf_pose.h"

#include <algorithm>
#include <span>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr const char* kAgain = "; export the level again";

// The weights of the shape keys of a node's mesh.
std::span<const Json> weights_of(const GltfScene& scene, std::size_t node) {
  const auto own = scene.json.list("nodes")[node].list("weights");
  const auto mesh = static_cast<std::size_t>(scene.nodes[node].mesh);
  return own.empty() ? scene.json.list("meshes")[mesh].list("weights") : own;
}

double weight_in(const Json& value) { return value.number() == nullptr ? 0 : *value.number(); }

}  // namespace

std::optional<Vec3> PrimitivePose::moved(std::size_t vertex, const Vec3& position) const {
  Vec3 p = position;
  for (const auto& [weight, moves] : keys_) {
    const auto move = moves.at(vertex);
    p += weight * Vec3(move[0], move[1], move[2]);
  }
  if (joints_ == nullptr) return p;
  Vec3 sum(0);
  double total = 0;
  for (const auto& [joints, weights] : influences_) {
    const auto joint = joints.at(vertex), weight = weights.at(vertex);
    for (std::size_t i = 0; i < 4; ++i) {
      if (!(weight[i] > 0)) continue;
      if (!(joint[i] >= 0 && joint[i] < static_cast<double>(joints_->size()))) return std::nullopt;
      sum += weight[i] * Vec3((*joints_)[static_cast<std::size_t>(joint[i])] * glm::dvec4(p, 1));
      total += weight[i];
    }
  }
  if (!(total > 0)) return std::nullopt;
  return sum / total;
}

GltfPose::GltfPose(const GltfScene& scene) : scene_(scene), kind_(scene.nodes.size(), 0) {
  const auto nodes = scene.json.list("nodes");
  for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
    if (scene.nodes[n].mesh == kNone) continue;
    const auto& primitives = scene.meshes[static_cast<std::size_t>(scene.nodes[n].mesh)].primitives;
    if (nodes[n].find("skin") != nullptr && !primitives.empty() &&
        primitives[0].accessor("JOINTS_0") != kNone)
      kind_[n] |= kSkinned;
    if (std::ranges::any_of(weights_of(scene, n),
                            [](const Json& key) { return weight_in(key) != 0; }))
      kind_[n] |= kKeyed;
  }
}

// Joints need not be in the scene, and nodes outside of it may form a cycle.
glm::dmat4 GltfPose::world_of(std::size_t node) const {
  glm::dmat4 world = scene_.nodes[node].local;
  std::size_t steps = 0;
  for (int at = scene_.nodes[node].parent; at != kNone && steps < scene_.nodes.size(); ++steps) {
    const GltfNode& above = scene_.nodes[static_cast<std::size_t>(at)];
    world = above.local * world;
    at = above.parent;
  }
  return world;
}

Result<const JointMatrices*> GltfPose::joints_of(std::size_t skin) {
  if (const auto known = joints_.find(skin); known != joints_.end()) return &known->second;
  const Json& json = scene_.json.list("skins")[skin];
  const auto joints = json.list("joints");
  if (joints.empty()) return Error(fmt::format("skin {} has no list of joints{}", skin, kAgain));
  std::optional<GltfReader> inverse;
  if (const Json* matrices = json.find("inverseBindMatrices")) {
    const auto accessor = index_below(matrices, scene_.accessors.size());
    if (!accessor)
      return Error(
          fmt::format("skin {} has inverseBindMatrices that are no accessor{}", skin, kAgain));
    auto reader = GltfReader::open(scene_, static_cast<int>(*accessor), 16);
    if (!reader.ok()) return reader.error();
    if (reader->count() < joints.size())
      return Error(fmt::format("skin {} has {} joints but {} inverse bind matrices{}", skin,
                               joints.size(), reader->count(), kAgain));
    inverse = std::move(*reader);
  }
  JointMatrices matrices;
  for (const Json& joint : joints) {
    const auto node = index_below(&joint, scene_.nodes.size());
    if (!node) return Error(fmt::format("skin {} has a joint that is no node{}", skin, kAgain));
    const glm::dmat4 bind = inverse ? inverse->matrix_at(matrices.size()) : glm::dmat4(1.0);
    matrices.push_back(world_of(*node) * bind);
  }
  return &joints_.emplace(skin, std::move(matrices)).first->second;
}

Result<PrimitivePose> GltfPose::open(int node, std::size_t primitive) {
  const auto n = static_cast<std::size_t>(node);
  const auto m = static_cast<std::size_t>(scene_.nodes[n].mesh);
  const GltfPrimitive& part = scene_.meshes[m].primitives[primitive];
  const auto vertices = GltfReader::open(scene_, part.positions(), 3);
  if (!vertices.ok()) return vertices.error();
  // A reader of one value per vertex.
  const auto reader = [&](int accessor, int components) -> Result<GltfReader> {
    if (accessor == kNone)
      return Error(std::string("a joint, weight or shape key is no accessor") + kAgain);
    auto opened = GltfReader::open(scene_, accessor, components);
    if (opened.ok() && opened->count() != vertices->count())
      return Error(fmt::format("accessor {} has {} elements for {} vertices{}", accessor,
                               opened->count(), vertices->count(), kAgain));
    return opened;
  };

  PrimitivePose pose;
  const auto weights = has_keys(node) ? weights_of(scene_, n) : std::span<const Json>();
  const auto keys = scene_.json.list("meshes")[m].list("primitives")[primitive].list("targets");
  for (std::size_t k = 0; k < std::min(weights.size(), keys.size()); ++k) {
    const double weight = weight_in(weights[k]);
    const Json* moves = keys[k].find("POSITION");
    if (weight == 0 || moves == nullptr) continue;
    const auto accessor = index_below(moves, scene_.accessors.size());
    auto opened = reader(accessor ? static_cast<int>(*accessor) : kNone, 3);
    if (!opened.ok()) return opened.error();
    pose.keys_.emplace_back(weight, std::move(*opened));
  }
  if (!is_skinned(node)) return pose;

  const auto skin =
      index_below(scene_.json.list("nodes")[n].find("skin"), scene_.json.list("skins").size());
  if (!skin) return Error(std::string("its skin does not exist") + kAgain);
  const auto joints = joints_of(*skin);
  if (!joints.ok()) return joints.error();
  pose.joints_ = *joints;
  for (int set = 0;; ++set) {
    const int joint = part.accessor(fmt::format("JOINTS_{}", set));
    if (joint == kNone) break;
    auto opened = reader(joint, 4);
    if (!opened.ok()) return opened.error();
    auto weight = reader(part.accessor(fmt::format("WEIGHTS_{}", set)), 4);
    if (!weight.ok()) return weight.error();
    pose.influences_.emplace_back(std::move(*opened), std::move(*weight));
  }
  return pose;
}

}  // namespace clamor
