#include "formats/gltf/gltf_scene.h"

#include <algorithm>

#include <glm/gtc/quaternion.hpp>

namespace clamor {

// The last of a name counts, as in all of the document.
int GltfPrimitive::accessor(std::string_view attribute) const {
  const auto it = std::find_if(attributes.rbegin(), attributes.rend(),
                               [&](const auto& known) { return known.first == attribute; });
  return it == attributes.rend() ? kNone : it->second;
}

std::size_t GltfScene::bytes() const {
  std::size_t bytes = 0;
  for (const FileBytes& buffer : buffers) bytes += buffer.size();
  return bytes;
}

std::optional<std::span<const std::byte>> GltfScene::bytes_of(const GltfView& view) const {
  const std::span<const std::byte> buffer = buffers[static_cast<std::size_t>(view.buffer)];
  if (view.offset > buffer.size() || view.length > buffer.size() - view.offset) return std::nullopt;
  return buffer.subspan(view.offset, view.length);
}

glm::dmat4 transform_of(std::span<const double> move, std::span<const double> turn,
                        std::span<const double> scale) {
  glm::dmat4 transform(1.0);
  if (!turn.empty()) {
    const glm::dquat rotation(turn[3], turn[0], turn[1], turn[2]);  // glm takes w first
    if (glm::length(rotation) > 0) transform = glm::mat4_cast(glm::normalize(rotation));
  }
  for (int axis = 0; !scale.empty() && axis < 3; ++axis)
    transform[axis] *= scale[static_cast<std::size_t>(axis)];
  if (!move.empty()) transform[3] = glm::dvec4(move[0], move[1], move[2], 1);
  return transform;
}

}  // namespace clamor
