#include "gltf_writer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace clamor::assets {

namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian, as we write it");

constexpr int kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;

// Values as the decimal a reader would have typed: 0.3, not 0.30000001192092896.
double tidy(double value) { return std::round(value * 1e6) / 1e6; }

nlohmann::json json_of(const Bands& bands) {
  nlohmann::json array = nlohmann::json::array();
  for (const float value : bands) array.push_back(tidy(value));
  return array;
}

nlohmann::json json_of(const Vec3& v) { return {tidy(v.x), tidy(v.y), tidy(v.z)}; }

nlohmann::json rotation_json(double yaw_rad) {
  return {0, tidy(std::sin(yaw_rad / 2)), 0, tidy(std::cos(yaw_rad / 2))};
}

std::int16_t normalized_short(double value) {
  return static_cast<std::int16_t>(std::lround(value * 32767));
}

void append_u32(std::string& bytes, std::size_t value) {
  for (int shift = 0; shift < 32; shift += 8)
    bytes.push_back(static_cast<char>((value >> shift) & 0xff));
}

void append_chunk(std::string& glb, const char* type, std::string content, char padding) {
  content.resize((content.size() + 3) / 4 * 4, padding);
  append_u32(glb, content.size());
  glb += std::string(type, 4) + content;
}

}  // namespace

GltfWriter::GltfWriter(const std::string& scene_name) {
  json_["asset"] = {
      {"version", "2.0"}, {"generator", "clamor make_assets"}, {"copyright", "CC0 1.0 Universal"}};
  json_["scene"] = 0;
  json_["scenes"] = {{{"name", scene_name}, {"nodes", Json::array()}}};
  for (const char* list : {"nodes", "meshes", "materials", "accessors", "bufferViews"})
    json_[list] = Json::array();
}

void GltfWriter::use(const char* extension) {
  Json& used = json_["extensionsUsed"];
  if (std::find(used.begin(), used.end(), extension) == used.end()) used.push_back(extension);
}

MaterialIndex GltfWriter::add_material(const std::string& name, const Look& look, Json acoustic) {
  use("CLAMOR_materials_acoustic");
  Json material = {{"name", name},
                   {"doubleSided", true},
                   {"pbrMetallicRoughness",
                    {{"baseColorFactor", {look.red, look.green, look.blue, look.opacity}},
                     {"metallicFactor", look.metallic},
                     {"roughnessFactor", look.roughness}}},
                   {"extensions", {{"CLAMOR_materials_acoustic", std::move(acoustic)}}}};
  if (look.opacity < 1) material["alphaMode"] = "BLEND";
  json_["materials"].push_back(std::move(material));
  return static_cast<MaterialIndex>(json_["materials"].size()) - 1;
}

MaterialIndex GltfWriter::material(const std::string& name, const Look& look,
                                   const std::string& preset) {
  return add_material(name, look, {{"preset", preset}});
}

MaterialIndex GltfWriter::material(const std::string& name, const Look& look,
                                   const Bands& absorption, const Bands& scattering) {
  return add_material(name, look,
                      {{"absorption", json_of(absorption)}, {"scattering", json_of(scattering)}});
}

int GltfWriter::accessor(const void* data, std::size_t bytes, std::size_t count, const char* type,
                         int component_type, std::optional<int> target, bool normalized) {
  binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
  Json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes}};
  if (target) view["target"] = *target;
  binary_.append(static_cast<const char*>(data), bytes);
  json_["bufferViews"].push_back(std::move(view));

  Json accessor = {{"bufferView", json_["bufferViews"].size() - 1},
                   {"componentType", component_type},
                   {"count", count},
                   {"type", type}};
  if (normalized) accessor["normalized"] = true;
  json_["accessors"].push_back(std::move(accessor));
  return static_cast<int>(json_["accessors"].size()) - 1;
}

int GltfWriter::mesh(const std::string& name, const MeshBuilder& mesh) {
  Json primitives = Json::array();
  for (const auto& [material, part] : mesh.parts()) {
    const std::vector<Vec3f>& vertices = part.vertices_m;
    const int position = accessor(vertices.data(), vertices.size() * sizeof(Vec3f), vertices.size(),
                                  "VEC3", kFloat, kArrayBuffer);
    Vec3f low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    for (const Vec3f& vertex : vertices) {
      low = glm::min(low, vertex);
      high = glm::max(high, vertex);
    }
    json_["accessors"].back()["min"] = {low.x, low.y, low.z};
    json_["accessors"].back()["max"] = {high.x, high.y, high.z};

    int indices;
    if (vertices.size() < 65535) {
      const std::vector<std::uint16_t> narrow(part.indices.begin(), part.indices.end());
      indices = accessor(narrow.data(), narrow.size() * 2, narrow.size(), "SCALAR", kUnsignedShort,
                         kElementArrayBuffer);
    } else {
      indices = accessor(part.indices.data(), part.indices.size() * 4, part.indices.size(),
                         "SCALAR", kUnsignedInt, kElementArrayBuffer);
    }
    primitives.push_back(
        {{"attributes", {{"POSITION", position}}}, {"indices", indices}, {"material", material}});
  }
  json_["meshes"].push_back({{"name", name}, {"primitives", std::move(primitives)}});
  return static_cast<int>(json_["meshes"].size()) - 1;
}

int GltfWriter::add_node(Json node, std::optional<int> parent) {
  const auto index = static_cast<int>(json_["nodes"].size());
  json_["nodes"].push_back(std::move(node));
  Json& siblings = parent ? json_["nodes"][static_cast<std::size_t>(*parent)]["children"]
                          : json_["scenes"][0]["nodes"];
  siblings.push_back(index);
  return index;
}

void GltfWriter::node(const std::string& name, int mesh, const Vec3& position_m, double yaw_rad) {
  Json node = {{"name", name}, {"mesh", mesh}};
  if (position_m != Vec3(0)) node["translation"] = json_of(position_m);
  if (yaw_rad != 0) node["rotation"] = rotation_json(yaw_rad);
  add_node(std::move(node));
}

std::size_t GltfWriter::put_sound(const std::string& name, const EmitterNode& emitter) {
  use("KHR_audio_emitter");
  use("CLAMOR_emitter");
  Json& audio = json_["extensions"]["KHR_audio_emitter"];
  audio["audio"].push_back({{"uri", emitter.sound_uri}});
  const std::size_t index = audio["audio"].size() - 1;
  audio["sources"].push_back(
      {{"name", name}, {"audio", index}, {"gain", 1}, {"loop", true}, {"autoPlay", true}});
  audio["emitters"].push_back({{"name", name},
                               {"type", "positional"},
                               {"gain", 1},
                               {"sources", {index}},
                               {"positional",
                                {{"shapeType", "omnidirectional"},
                                 {"distanceModel", "inverse"},
                                 {"refDistance", 1},
                                 {"rolloffFactor", 1}}}});
  return index;
}

int GltfWriter::emitter(const std::string& name, const EmitterNode& emitter) {
  const std::size_t index = put_sound(name, emitter);
  json_["extensions"]["KHR_audio_emitter"]["emitters"][index]["extensions"]["CLAMOR_emitter"] = {
      {"directivity", json_of(emitter.directivity)}, {"gain_db", emitter.gain_db}};
  return static_cast<int>(index);
}

void GltfWriter::emitter_node(const std::string& name, const EmitterNode& emitter,
                              const Vec3& position_m, double yaw_rad) {
  Json node = {
      {"name", name}, {"translation", json_of(position_m)}, {"rotation", rotation_json(yaw_rad)}};
  node["extensions"]["KHR_audio_emitter"] = {{"emitters", {put_sound(name, emitter)}}};
  node["extensions"]["CLAMOR_emitter"] = {{"directivity", json_of(emitter.directivity)},
                                          {"gain_db", emitter.gain_db},
                                          {"random_delay_s", emitter.random_delay_s}};
  add_node(std::move(node));
}

int GltfWriter::group(const std::string& name, std::optional<int> parent, const Vec3& position_m,
                      double yaw_rad) {
  Json node = {{"name", name}, {"children", Json::array()}};
  if (position_m != Vec3(0)) node["translation"] = json_of(position_m);
  if (yaw_rad != 0) node["rotation"] = rotation_json(yaw_rad);
  return add_node(std::move(node), parent);
}

InstanceList GltfWriter::instances(const std::vector<Instance>& instances) {
  std::vector<Vec3f> translations, scales;
  std::vector<std::int16_t> rotations;
  std::vector<float> delays;
  for (const Instance& instance : instances) {
    translations.emplace_back(instance.position_m);
    scales.emplace_back(Vec3(instance.scale));
    rotations.insert(rotations.end(), {0, normalized_short(std::sin(instance.yaw_rad / 2)), 0,
                                       normalized_short(std::cos(instance.yaw_rad / 2))});
    delays.push_back(static_cast<float>(instance.delay_s));
  }
  const std::size_t count = instances.size();
  InstanceList list{};
  list.translation =
      accessor(translations.data(), count * sizeof(Vec3f), count, "VEC3", kFloat, {});
  list.rotation = accessor(rotations.data(), count * 8, count, "VEC4", kShort, {}, true);
  list.scale = accessor(scales.data(), count * sizeof(Vec3f), count, "VEC3", kFloat, {});
  list.delay = accessor(delays.data(), count * sizeof(float), count, "SCALAR", kFloat, {});
  return list;
}

void GltfWriter::instanced_node(const std::string& name, int parent, int mesh,
                                const InstanceList& instances, int emitter, double delay_s) {
  use("EXT_mesh_gpu_instancing");
  Json node = {{"name", name}, {"mesh", mesh}};
  node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", instances.translation},
      {"ROTATION", instances.rotation},
      {"SCALE", instances.scale},
      {"_DELAY_S", instances.delay}};
  node["extensions"]["KHR_audio_emitter"] = {{"emitters", {emitter}}};
  node["extensions"]["CLAMOR_emitter"] = {{"delay_s", tidy(delay_s)}};
  add_node(std::move(node), parent);
}

std::string GltfWriter::glb() {
  binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
  json_["buffers"] = {{{"byteLength", binary_.size()}}};

  std::string chunks;
  append_chunk(chunks, "JSON", json_.dump(), ' ');
  append_chunk(chunks, "BIN\0", binary_, '\0');
  std::string file = "glTF";
  append_u32(file, 2);
  append_u32(file, 12 + chunks.size());
  return file + chunks;
}

}  // namespace clamor::assets
