#include "formats/gltf/gltf_pose.h"

#include <cmath>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr const char* kAgain = "; export the level again";

// An index into a list of `count`, or nothing.
std::optional<std::size_t> index_in(const Json* value, std::size_t count) {
  if (value == nullptr || value->number() == nullptr) return std::nullopt;
  const double number = *value->number();
  if (!(number >= 0) || number >= static_cast<double>(count) || std::floor(number) != number)
    return std::nullopt;
  return static_cast<std::size_t>(number);
}

// The weights of the shape keys of a node's mesh; null if there are none.
const Json::Array* weights_of(const Json& node, const Json& mesh) {
  for (const Json* object : {&node, &mesh})
    if (const Json* weights = object->find("weights"))
      if (weights->array() != nullptr) return weights->array();
  return nullptr;
}

double number_in(const Json::Array& list, std::size_t i) {
  const double* number = i < list.size() ? list[i].number() : nullptr;
  return number == nullptr ? 0 : *number;
}

bool has_weight(const Json::Array* weights) {
  for (std::size_t i = 0; weights != nullptr && i < weights->size(); ++i)
    if (number_in(*weights, i) != 0) return true;
  return false;
}

bool has_influences(const Json& mesh) {
  const Json* primitive = mesh.element("primitives", 0);
  return primitive != nullptr && primitive->find({"attributes", "JOINTS_0"}) != nullptr;
}

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
  bool is_any_skinned = false;
  for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
    if (scene.nodes[n].mesh == kNone) continue;
    const Json& node = *scene.json.element("nodes", n);
    const Json& mesh = *scene.json.element("meshes", static_cast<std::size_t>(scene.nodes[n].mesh));
    if (node.find("skin") != nullptr && has_influences(mesh)) kind_[n] |= kSkinned;
    if (has_weight(weights_of(node, mesh))) kind_[n] |= kKeyed;
    is_any_skinned |= (kind_[n] & kSkinned) != 0;
  }
  if (!is_any_skinned) return;
  parents_.assign(scene.nodes.size(), kNone);
  for (std::size_t n = 0; n < scene.nodes.size(); ++n)
    for (const int child : scene.nodes[n].children)
      parents_[static_cast<std::size_t>(child)] = static_cast<int>(n);
}

// Joints need not be in the scene, and nodes outside of it may form a cycle.
glm::dmat4 GltfPose::world_of(std::size_t node) const {
  glm::dmat4 world = scene_.nodes[node].local;
  std::size_t steps = 0;
  for (int at = parents_[node]; at != kNone && steps < scene_.nodes.size(); ++steps) {
    world = scene_.nodes[static_cast<std::size_t>(at)].local * world;
    at = parents_[static_cast<std::size_t>(at)];
  }
  return world;
}

Result<const JointMatrices*> GltfPose::joints_of(std::size_t skin) {
  if (const auto known = joints_.find(skin); known != joints_.end()) return &known->second;
  const Json& json = *scene_.json.element("skins", skin);
  const Json* joints = json.find("joints");
  if (joints == nullptr || joints->array() == nullptr || joints->array()->empty())
    return Error(fmt::format("skin {} has no list of joints{}", skin, kAgain));
  std::optional<GltfReader> inverse;
  if (const Json* matrices = json.find("inverseBindMatrices")) {
    const auto accessor = index_in(matrices, scene_.accessors.size());
    if (!accessor)
      return Error(
          fmt::format("skin {} has inverseBindMatrices that are no accessor{}", skin, kAgain));
    auto reader = GltfReader::open(scene_, static_cast<int>(*accessor), 16);
    if (!reader.ok()) return reader.error();
    if (reader->count() < joints->array()->size())
      return Error(fmt::format("skin {} has {} joints but {} inverse bind matrices{}", skin,
                               joints->array()->size(), reader->count(), kAgain));
    inverse = std::move(*reader);
  }
  JointMatrices matrices;
  for (const Json& joint : *joints->array()) {
    const auto node = index_in(&joint, scene_.nodes.size());
    if (!node) return Error(fmt::format("skin {} has a joint that is no node{}", skin, kAgain));
    const glm::dmat4 bind = inverse ? inverse->matrix_at(matrices.size()) : glm::dmat4(1.0);
    matrices.push_back(world_of(*node) * bind);
  }
  return &joints_.emplace(skin, std::move(matrices)).first->second;
}

Result<PrimitivePose> GltfPose::open(int node, std::size_t primitive) {
  const auto n = static_cast<std::size_t>(node);
  const auto m = static_cast<std::size_t>(scene_.nodes[n].mesh);
  const Json &json = *scene_.json.element("nodes", n), &mesh = *scene_.json.element("meshes", m);
  const Json& part = *mesh.element("primitives", primitive);
  const auto vertices =
      GltfReader::open(scene_, scene_.meshes[m].primitives[primitive].positions, 3);
  if (!vertices.ok()) return vertices.error();
  // A reader of one value per vertex.
  const auto reader = [&](const Json* value, int components) -> Result<GltfReader> {
    const auto accessor = index_in(value, scene_.accessors.size());
    if (!accessor)
      return Error(std::string("a joint, weight or shape key is no accessor") + kAgain);
    auto opened = GltfReader::open(scene_, static_cast<int>(*accessor), components);
    if (opened.ok() && opened->count() != vertices->count())
      return Error(fmt::format("accessor {} has {} elements for {} vertices{}", *accessor,
                               opened->count(), vertices->count(), kAgain));
    return opened;
  };

  PrimitivePose pose;
  const Json::Array* weights = has_keys(node) ? weights_of(json, mesh) : nullptr;
  for (std::size_t k = 0; weights != nullptr && k < weights->size(); ++k) {
    const double weight = number_in(*weights, k);
    const Json* key = part.element("targets", k);
    const Json* moves = key == nullptr ? nullptr : key->find("POSITION");
    if (weight == 0 || moves == nullptr) continue;
    auto opened = reader(moves, 3);
    if (!opened.ok()) return opened.error();
    pose.keys_.emplace_back(weight, std::move(*opened));
  }
  if (!is_skinned(node)) return pose;

  const Json* skins = scene_.json.find("skins");
  const auto skin =
      index_in(json.find("skin"),
               skins == nullptr || skins->array() == nullptr ? 0 : skins->array()->size());
  if (!skin) return Error(std::string("its skin does not exist") + kAgain);
  const auto joints = joints_of(*skin);
  if (!joints.ok()) return joints.error();
  pose.joints_ = *joints;
  for (int set = 0;; ++set) {
    const Json* joint = part.find({"attributes", fmt::format("JOINTS_{}", set)});
    if (joint == nullptr) break;
    auto opened = reader(joint, 4);
    if (!opened.ok()) return opened.error();
    auto weight = reader(part.find({"attributes", fmt::format("WEIGHTS_{}", set)}), 4);
    if (!weight.ok()) return weight.error();
    pose.influences_.emplace_back(std::move(*opened), std::move(*weight));
  }
  return pose;
}

}  // namespace clamor
