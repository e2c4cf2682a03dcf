#include "formats/gltf/gltf_compression.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/memory_size.h"
#include "formats/gltf/draco_codec.h"
#include "formats/gltf/gltf_accessor.h"
#include "formats/gltf/meshopt_codec.h"

namespace clamor {

namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr double kMaxUnsigned = 4294967295.0, kMaxOffset = 1e15;

// Vertex attributes, but for those of renderers and applications.
bool is_unpacked(std::string_view attribute) {
  static constexpr std::array<std::string_view, 5> kUnread = {"NORMAL", "TANGENT", "TEXCOORD_",
                                                              "COLOR_", "_"};
  return std::none_of(kUnread.begin(), kUnread.end(),
                      [&](auto unread) { return attribute.starts_with(unread); });
}

// A required whole number of an unchecked object.
std::size_t needed(JsonFields& fields, std::string_view key, double high) {
  const auto value = fields.whole_number(key, 0, high);
  if (!value) fields.fail(in_quotes(key) + " is missing");
  return memory_size(value.value_or(0));
}

double last_of(const auto& list) { return static_cast<double>(list.size()) - 1; }

// --- Buffer views compressed by meshopt ---------------------------------------------------------

// Marks the accessors of attributes and animations that nobody reads.
std::vector<bool> unread_accessors(const Json& document) {
  std::vector<bool> unread(document.list("accessors").size(), false);
  std::vector<std::size_t> read;
  const auto mark = [&](const Json* index) {
    if (const auto known = index_below(index, unread.size())) unread[*known] = true;
  };
  for (const Json& animation : document.list("animations"))
    for (const Json& sampler : animation.list("samplers"))
      for (const char* key : {"input", "output"}) mark(sampler.find(key));
  const auto mark_all = [&](const Json& attributes) {
    if (attributes.object() == nullptr) return;
    for (const auto& [name, accessor] : *attributes.object())
      if (!is_unpacked(name))
        mark(&accessor);
      else if (const auto known = index_below(&accessor, unread.size()))
        read.push_back(*known);
  };
  for (const Json& mesh : document.list("meshes"))
    for (const Json& primitive : mesh.list("primitives")) {
      mark_all(*primitive.find("attributes"));
      for (const Json& target : primitive.list("targets")) mark_all(target);
    }
  for (const std::size_t accessor : read) unread[accessor] = false;
  return unread;
}

// Marks the buffer views that hold unread accessors alone.
std::vector<bool> unread_views(const GltfScene& scene) {
  const std::vector<bool> unread = unread_accessors(scene.json);
  std::vector<bool> views(scene.views.size(), false);
  for (const bool marks : {true, false})
    for (std::size_t a = 0; a < unread.size(); ++a)
      if (const int view = scene.accessors[a].view; unread[a] == marks && view != kNone)
        views[static_cast<std::size_t>(view)] = marks;
  return views;
}

// `room_bytes` is what the views may still unpack to, however many share a stream.
Result<void> unpack_view(GltfScene& scene, GltfView& view, const Json& packed,
                         const std::string& where, double& room_bytes) {
  JsonFields fields(packed, where);
  GltfView stream;
  stream.buffer = static_cast<int>(needed(fields, "buffer", last_of(scene.buffers)));
  stream.length = needed(fields, "byteLength", kMaxOffset);
  stream.offset = static_cast<std::size_t>(fields.number("byteOffset", 0, kMaxOffset).value_or(0));
  MeshoptView meshopt;
  meshopt.mode = fields.string("mode").value_or("");
  meshopt.filter = fields.string("filter").value_or("NONE");
  meshopt.count = needed(fields, "count", kMaxOffset);
  meshopt.stride = needed(fields, "byteStride", kMaxOffset);
  if (const auto ok = fields.result(); !ok.ok()) return ok.error();
  const auto bytes = scene.bytes_of(stream);
  if (!bytes)
    return Error(
        fmt::format("{}: needs bytes {} to {}, but buffer {} has only {}; copy or write the "
                    "level again.",
                    where, stream.offset, stream.offset + stream.length, stream.buffer,
                    scene.buffers[static_cast<std::size_t>(stream.buffer)].size()));
  if (view.stride != 0 && view.stride != meshopt.stride)
    return Error(
        fmt::format("{}: unpacks to elements of {} bytes, but the view has a stride of {}; "
                    "write the level again.",
                    where, meshopt.stride, view.stride));
  room_bytes -= static_cast<double>(meshopt.count) * static_cast<double>(meshopt.stride);
  if (room_bytes < 0)
    return Error(where + ": the level unpacks to more than its bytes can hold; write it again.");
  auto unpacked = decode_meshopt(meshopt, *bytes);
  if (!unpacked.ok()) return unpacked.error().in(where);
  view = {static_cast<int>(scene.buffers.size()), 0, unpacked->size(), view.stride};
  scene.buffers.push_back(std::move(*unpacked));
  return {};
}

bool is_required(const Json& document, std::string_view extension) {
  return std::ranges::any_of(document.list("extensionsRequired"), [&](const Json& name) {
    return name.string() != nullptr && *name.string() == extension;
  });
}

// The compression of a buffer view, or null, and its extension.
std::pair<const Json*, std::string> compression_of(const Json& view) {
  for (const char* name : {"KHR_meshopt_compression", "EXT_meshopt_compression"})
    if (const Json* packed = view.find({"extensions", name})) return {packed, name};
  return {};
}

Result<void> unpack_views(GltfScene& scene) {
  const std::vector<bool> unread = unread_views(scene);
  double room_bytes = kMaxUnpackedPerByte * static_cast<double>(scene.bytes());
  for (std::size_t v = 0; v < unread.size(); ++v) {
    GltfView& view = scene.views[v];
    const bool is_there = scene.bytes_of(view).has_value();
    const auto [packed, extension] = compression_of(scene.json.list("bufferViews")[v]);
    if (is_there && (packed == nullptr || !is_required(scene.json, extension))) continue;
    if (packed == nullptr || unread[v]) {
      view.offset = view.length = 0;
      continue;
    }
    const std::string where = fmt::format("bufferViews[{}]: {}", v, extension);
    if (const auto ok = unpack_view(scene, view, *packed, where, room_bytes); !ok.ok()) return ok;
  }
  return {};
}

// --- Primitives compressed by Draco -------------------------------------------------------------

class DracoPrimitives {
 public:
  explicit DracoPrimitives(GltfScene& scene) : scene_(scene) {}

  Result<void> unpack() {
    for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
      const auto primitives = scene_.json.list("meshes")[m].list("primitives");
      for (std::size_t p = 0; p < primitives.size(); ++p) {
        GltfPrimitive& primitive = scene_.meshes[m].primitives[p];
        const Json* packed = primitives[p].find({"extensions", kDraco});
        if (packed == nullptr || is_there(primitive)) continue;
        if (const auto ok = add(primitive, *packed, fmt::format("mesh {}: {}", m, kDraco));
            !ok.ok())
          return ok;
      }
    }
    if (streams_.empty()) return {};
    auto decoded = decode_draco(streams_, scene_.bytes());
    if (!decoded.ok()) return decoded.error();
    place(std::move(*decoded));
    return {};
  }

 private:
  // A primitive, its stream, and which of its attributes are read, in the order of the stream's.
  struct User {
    GltfPrimitive* primitive;
    std::size_t stream;
    std::vector<std::size_t> attributes;
  };

  const GltfAccessor& accessor(int index) const {
    return scene_.accessors[static_cast<std::size_t>(index)];
  }

  // Whether the primitive has its indices and the attributes that are read without compression,
  // too.
  bool is_there(const GltfPrimitive& primitive) const {
    for (const auto& [name, index] : primitive.attributes)
      if (is_unpacked(name) && accessor(index).view == kNone) return false;
    return primitive.indices == kNone || accessor(primitive.indices).view != kNone;
  }

  Result<void> add(GltfPrimitive& primitive, const Json& packed, const std::string& where) {
    JsonFields fields(packed, where);
    const std::size_t view = needed(fields, "bufferView", last_of(scene_.views));
    const Json* ids = fields.any("attributes");
    if (ids == nullptr || ids->object() == nullptr) fields.fail("has no object 'attributes'");
    if (const auto ok = fields.result(); !ok.ok()) return ok;

    User user{&primitive, streams_.size(), {}};
    DracoPrimitive stream{
        where, scene_.bytes_of(scene_.views[view]).value_or(std::span<const std::byte>()), {}, 0};
    JsonFields id_fields(*ids, where + ": attributes");
    for (std::size_t a = 0; a < primitive.attributes.size(); ++a) {
      const auto& [name, index] = primitive.attributes[a];
      if (!is_unpacked(name) || ids->find(name) == nullptr) continue;
      const auto id = static_cast<std::uint32_t>(needed(id_fields, name, kMaxUnsigned));
      const GltfAccessor& stated = accessor(index);
      if (stated.components > 4 || component_bytes(stated.component_type) == 0)
        id_fields.fail(in_quotes(name) + " has an accessor whose type Draco does not have");
      stream.attributes.push_back({id, stated.component_type, stated.components});
      stream.stated_elements += stated.count;
      user.attributes.push_back(a);
    }
    if (const auto ok = id_fields.result(); !ok.ok()) return ok;
    if (primitive.indices != kNone) stream.stated_elements += accessor(primitive.indices).count;
    const auto [known, is_new] =
        known_.try_emplace(std::pair(view, stream.attributes), streams_.size());
    user.stream = known->second;
    if (is_new) streams_.push_back(std::move(stream));
    users_.push_back(std::move(user));
    return {};
  }

  // Appends an accessor on the decoded bytes from `offset` on, and returns its index.
  int append(GltfAccessor accessor, std::size_t count, std::size_t offset) {
    accessor.count = count;
    accessor.offset = 0;
    accessor.view = static_cast<int>(scene_.views.size());
    const std::size_t bytes = count * component_bytes(accessor.component_type) *
                              static_cast<std::size_t>(accessor.components);
    scene_.views.push_back({static_cast<int>(scene_.buffers.size()), offset, bytes, 0});
    scene_.accessors.push_back(accessor);
    return static_cast<int>(scene_.accessors.size() - 1);
  }

  // Lets the primitives refer to new accessors on the decoded bytes.
  void place(DecodedDraco decoded) {
    for (const User& user : users_) {
      const DracoGeometry& geometry = decoded.geometries[user.stream];
      for (std::size_t a = 0; a < user.attributes.size(); ++a) {
        int& index = user.primitive->attributes[user.attributes[a]].second;
        GltfAccessor unpacked = accessor(index);
        if (geometry.steps[a] > 0) unpacked.step = geometry.steps[a];
        index = append(unpacked, geometry.vertices, geometry.attribute_offsets[a]);
      }
      GltfAccessor indices;
      indices.component_type = 5125;
      user.primitive->indices = append(indices, geometry.indices, geometry.index_offset);
      user.primitive->mode = 4;
    }
    scene_.buffers.push_back(std::move(decoded.bytes));
  }

  GltfScene& scene_;
  std::vector<User> users_;
  std::vector<DracoPrimitive> streams_;
  std::map<std::pair<std::size_t, std::vector<DracoAttribute>>, std::size_t> known_;
};

}  // namespace

Result<void> unpack_geometry(GltfScene& scene) {
  if (const auto ok = unpack_views(scene); !ok.ok()) return ok;
  return DracoPrimitives(scene).unpack();
}

}  // namespace clamor
