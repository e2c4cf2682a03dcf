#include "formats/gltf/gltf_reader.h"

#include <algorithm>
#include <limits>

#include <glm/gtc/quaternion.hpp>
#include <tiny_gltf.h>

#include "formats/gltf/gltf_check.h"
#include "formats/gltf/gltf_compression.h"
#include "formats/gltf/gltf_scenes.h"

namespace clamor {

namespace {

bool load_no_image(tinygltf::Image*, int, std::string*, std::string*, int, int,
                   const unsigned char*, int, void*) {
  return true;
}

tinygltf::FsCallbacks no_files() {
  tinygltf::FsCallbacks callbacks{};
  callbacks.FileExists = [](const std::string&, void*) { return false; };
  callbacks.ExpandFilePath = [](const std::string& path, void*) { return path; };
  callbacks.ReadWholeFile = [](std::vector<unsigned char>*, std::string*, const std::string&,
                               void*) { return false; };
  callbacks.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&,
                                void*) { return false; };
  return callbacks;
}

glm::dmat4 local_transform(const tinygltf::Node& node) {
  glm::dmat4 local(1.0);
  if (node.matrix.size() == 16) {  // both are column-major
    for (int i = 0; i < 16; ++i) local[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
    return local;
  }
  if (node.rotation.size() == 4) {
    const auto& q = node.rotation;  // x, y, z, w; glm's constructor takes w first
    const glm::dquat turn(q[3], q[0], q[1], q[2]);
    if (glm::length(turn) > 0) local = glm::mat4_cast(glm::normalize(turn));
  }
  if (node.scale.size() == 3)
    for (int i = 0; i < 3; ++i) local[i] *= node.scale[static_cast<std::size_t>(i)];
  if (node.translation.size() == 3)
    local[3] = glm::dvec4(node.translation[0], node.translation[1], node.translation[2], 1);
  return local;
}

GltfAccessor plain(const tinygltf::Accessor& from) {
  GltfAccessor to;
  to.view = from.bufferView;
  to.offset = from.byteOffset;
  to.component_type = from.componentType;
  to.components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(from.type));
  to.count = from.count;
  to.normalized = from.normalized;
  if (!from.sparse.isSparse) return to;
  to.sparse_count = static_cast<std::size_t>(from.sparse.count);
  to.sparse_index_view = from.sparse.indices.bufferView;
  to.sparse_index_offset = static_cast<std::size_t>(from.sparse.indices.byteOffset);
  to.sparse_index_type = from.sparse.indices.componentType;
  to.sparse_value_view = from.sparse.values.bufferView;
  to.sparse_value_offset = static_cast<std::size_t>(from.sparse.values.byteOffset);
  return to;
}

GltfMesh plain(const tinygltf::Mesh& from) {
  GltfMesh to{from.name, {}};
  for (const auto& primitive : from.primitives) {
    const auto positions = primitive.attributes.find("POSITION");
    to.primitives.push_back({primitive.mode,
                             positions == primitive.attributes.end() ? kNone : positions->second,
                             primitive.indices, primitive.material});
  }
  return to;
}

Result<tinygltf::Model> parse(const Json& document) {
  const std::string text = essential_gltf(document);
  if (text.size() > std::numeric_limits<unsigned>::max())
    return Error("its JSON is larger than 4 GiB; export it as .glb, with binary buffers.");
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(load_no_image, nullptr);
  loader.SetFsCallbacks(no_files());
  tinygltf::Model model;
  std::string error, warning;
  bool ok = false;
  try {
    ok = loader.LoadASCIIFromString(&model, &error, &warning, text.data(),
                                    static_cast<unsigned>(text.size()), "");
  } catch (const std::exception& exception) {
    error = exception.what();
  }
  if (ok) return model;
  std::replace(error.begin(), error.end(), '\n', ' ');
  return Error("is no valid glTF: " + error + "(correct it or export the level again).");
}

}  // namespace

Result<GltfScene> read_gltf_scene(GltfDocument document, const std::optional<std::string>& wanted) {
  const auto chosen = choose_scene(document.json, wanted);
  if (!chosen.ok()) return chosen.error();
  if (const auto ok = unpack_geometry(document); !ok.ok()) return ok.error();
  const auto model = parse(document.json);
  if (!model.ok()) return model.error();

  GltfScene scene;
  for (const auto& view : model->bufferViews)
    scene.views.push_back({view.buffer, view.byteOffset, view.byteLength, view.byteStride});
  for (const auto& accessor : model->accessors) scene.accessors.push_back(plain(accessor));
  for (const auto& [accessor, step] : document.steps) scene.accessors[accessor].step = step;
  for (const auto& mesh : model->meshes) scene.meshes.push_back(plain(mesh));
  for (const auto& node : model->nodes)
    scene.nodes.push_back({node.name, node.children, node.mesh, local_transform(node)});
  for (const auto& material : model->materials) scene.materials.push_back(material.name);
  scene.json = std::move(document.json);
  scene.chosen = *chosen;
  scene.roots = scene_roots(scene, scene.chosen);
  scene.buffers = std::move(document.buffers);
  for (const FileBytes& buffer : scene.buffers) scene.bytes += buffer.size();
  return scene;
}

}  // namespace clamor
