// gltf_writer.h: builds a .glb: materials with acoustics, meshes, instances, emitters.
//
// Supported extensions of glTF:
//   EXT_mesh_gpu_instancing    instances of a node's mesh and emitter; _DELAY_S delays each
//   KHR_audio_emitter          sounds by relative uri, one looping source and emitter for each
//   CLAMOR_materials_acoustic  on a material: a preset, or absorption and scattering per band
//   CLAMOR_emitter             on a node or its emitter: directivity exponents per band, level,
//   start
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "common/bands.h"
#include "common/vec.h"
#include "mesh_builder.h"

namespace clamor::assets {

struct Look {
  double red, green, blue;  // linear, 0 to 1
  double roughness = 0.9, metallic = 0, opacity = 1;
};

struct EmitterNode {
  std::string sound_uri;  // relative to the level's folder
  Bands directivity{};    // exponent per band, axis along the node's -Z
  double gain_db = 0;     // amplitude at 1 m on axis, re full scale
  double random_delay_s = 0;
};

// Transform of an instance: rotated by yaw about +Y, scaled, translated.
struct Instance {
  Vec3 position_m;
  double yaw_rad = 0;  // 0 faces -Z, grows to the left
  double scale = 1;
  double delay_s = 0;  // start delay of its emitter
};

// Accessors of instance attributes, which nodes may share.
struct InstanceList {
  int translation, rotation, scale, delay;  // accessors
};

class GltfWriter {
 public:
  explicit GltfWriter(const std::string& scene_name);

  // A material by preset of assets/materials.json or by values.
  MaterialIndex material(const std::string& name, const Look& look, const std::string& preset);
  MaterialIndex material(const std::string& name, const Look& look, const Bands& absorption,
                         const Bands& scattering);

  int mesh(const std::string& name, const MeshBuilder& mesh);

  void node(const std::string& name, int mesh, const Vec3& position_m = Vec3(0),
            double yaw_rad = 0);
  void emitter_node(const std::string& name, const EmitterNode& emitter, const Vec3& position_m,
                    double yaw_rad);

  // Shared by nodes: a sound, a parent (none: the scene), attributes of instances.
  int emitter(const std::string& name, const EmitterNode& emitter);
  int group(const std::string& name, std::optional<int> parent, const Vec3& position_m,
            double yaw_rad);
  InstanceList instances(const std::vector<Instance>& instances);
  void instanced_node(const std::string& name, int parent, int mesh, const InstanceList& instances,
                      int emitter, double delay_s);

  // Returns the file. Call once.
  std::string glb();

 private:
  using Json = nlohmann::json;

  int accessor(const void* data, std::size_t bytes, std::size_t count, const char* type,
               int component_type, std::optional<int> target, bool normalized = false);
  MaterialIndex add_material(const std::string& name, const Look& look, Json acoustic);
  std::size_t put_sound(const std::string& name, const EmitterNode& emitter);
  void use(const char* extension);
  int add_node(Json node, std::optional<int> parent = {});

  Json json_;
  std::string binary_;
};

}  // namespace clamor::assets
