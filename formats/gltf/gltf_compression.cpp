#include "formats/gltf/gltf_compression.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

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

Json* mutable_member(Json& object, std::string_view key) {
  Json::Object& members = *object.object();
  const auto it = std::find_if(members.rbegin(), members.rend(),
                               [&](const auto& member) { return member.first == key; });
  return it == members.rend() ? nullptr : &it->second;
}

void set_member(Json& object, std::string_view key, Json value) {
  if (Json* known = mutable_member(object, key))
    *known = std::move(value);
  else
    object.object()->emplace_back(key, std::move(value));
}

void set_number(Json& object, std::string_view key, std::size_t value) {
  set_member(object, key, Json(static_cast<double>(value)));
}

// Returns the index of the new element of a list.
std::size_t append_to(Json& document, const char* list, Json::Object item) {
  Json* items = mutable_member(document, list);
  items->array()->emplace_back(std::move(item));
  return items->array()->size() - 1;
}

std::size_t size_member(const Json& checked, std::string_view key) {
  const Json* value = checked.find(key);
  return value == nullptr ? 0 : static_cast<std::size_t>(*value->number());
}

// A required whole number of an unchecked object.
std::size_t whole_number(JsonFields& fields, std::string_view key, double high) {
  const auto value = fields.number(key, 0, high);
  if (!value) fields.fail(in_quotes(key) + " is missing");
  if (value && std::floor(*value) != *value)
    fields.fail(in_quotes(key) + " must be a whole number");
  return static_cast<std::size_t>(value.value_or(0));
}

const Json::Array& array_member(const Json& object, std::string_view key) {
  static const Json::Array kEmpty;
  const Json* list = object.find(key);
  return list == nullptr || list->array() == nullptr ? kEmpty : *list->array();
}

// The bytes of a buffer view; none if its buffer is a fallback that is not there.
std::optional<std::span<const std::byte>> bytes_of_view(const GltfDocument& document,
                                                        const Json& view) {
  const FileBytes& buffer = document.buffers[size_member(view, "buffer")];
  const std::size_t offset = size_member(view, "byteOffset");
  const std::size_t length = size_member(view, "byteLength");
  if (offset > buffer.size() || length > buffer.size() - offset) return std::nullopt;
  return std::span(buffer).subspan(offset, length);
}

std::size_t bytes_of_buffers(const GltfDocument& document) {
  std::size_t bytes = 0;
  for (const FileBytes& buffer : document.buffers) bytes += buffer.size();
  return bytes;
}

// --- Buffer views compressed by meshopt ---------------------------------------------------------

// Marks the accessors of attributes and animations that nobody reads.
std::vector<bool> unread_accessors(const Json& document) {
  std::vector<bool> unread(array_member(document, "accessors").size(), false);
  std::vector<std::size_t> read;
  const auto mark = [&](const Json* index) {
    const double* number = index == nullptr ? nullptr : index->number();
    if (number != nullptr && *number >= 0 && *number < static_cast<double>(unread.size()))
      unread[static_cast<std::size_t>(*number)] = true;
  };
  for (const Json& animation : array_member(document, "animations"))
    for (const Json& sampler : array_member(animation, "samplers"))
      for (const char* key : {"input", "output"}) mark(sampler.find(key));
  const auto mark_all = [&](const Json& attributes) {
    if (attributes.object() == nullptr) return;
    for (const auto& [name, accessor] : *attributes.object())
      if (!is_unpacked(name))
        mark(&accessor);
      else if (accessor.number() != nullptr && *accessor.number() >= 0)
        read.push_back(static_cast<std::size_t>(*accessor.number()));
  };
  for (const Json& mesh : array_member(document, "meshes"))
    for (const Json& primitive : array_member(mesh, "primitives")) {
      mark_all(*primitive.find("attributes"));
      for (const Json& target : array_member(primitive, "targets")) mark_all(target);
    }
  for (const std::size_t accessor : read)
    if (accessor < unread.size()) unread[accessor] = false;
  return unread;
}

// Marks the buffer views that hold unread accessors alone.
std::vector<bool> unread_views(const Json& document) {
  const std::vector<bool> unread = unread_accessors(document);
  const Json::Array& accessors = array_member(document, "accessors");
  std::vector<bool> views(array_member(document, "bufferViews").size(), false);
  for (const bool marks : {true, false})
    for (std::size_t a = 0; a < accessors.size(); ++a)
      if (unread[a] == marks && accessors[a].find("bufferView") != nullptr)
        views[size_member(accessors[a], "bufferView")] = marks;
  return views;
}

// `room_bytes` is what the views may still unpack to, however many share a stream.
Result<void> unpack_view(GltfDocument& document, Json& view, const Json& packed,
                         const std::string& where, double& room_bytes) {
  JsonFields fields(packed, where);
  const std::size_t buffer =
      whole_number(fields, "buffer", static_cast<double>(document.buffers.size()) - 1);
  const std::size_t length = whole_number(fields, "byteLength", kMaxOffset);
  const auto offset =
      static_cast<std::size_t>(fields.number("byteOffset", 0, kMaxOffset).value_or(0));
  MeshoptView meshopt;
  meshopt.mode = fields.string("mode").value_or("");
  meshopt.filter = fields.string("filter").value_or("NONE");
  meshopt.count = whole_number(fields, "count", kMaxOffset);
  meshopt.stride = whole_number(fields, "byteStride", kMaxOffset);
  if (const auto ok = fields.result(); !ok.ok()) return ok.error();
  const FileBytes& bytes = document.buffers[buffer];
  if (offset > bytes.size() || length > bytes.size() - offset)
    return Error(
        fmt::format("{}: needs bytes {} to {}, but buffer {} has only {}; copy or write the "
                    "level again.",
                    where, offset, offset + length, buffer, bytes.size()));
  if (const Json* stride = view.find("byteStride");
      stride != nullptr && *stride->number() != static_cast<double>(meshopt.stride))
    return Error(
        fmt::format("{}: unpacks to elements of {} bytes, but the view has a stride of {}; "
                    "write the level again.",
                    where, meshopt.stride, *stride->number()));
  room_bytes -= static_cast<double>(meshopt.count) * static_cast<double>(meshopt.stride);
  if (room_bytes < 0)
    return Error(where + ": the level unpacks to more than its bytes can hold; write it again.");
  auto unpacked = decode_meshopt(meshopt, std::span(bytes).subspan(offset, length));
  if (!unpacked.ok()) return unpacked.error().in(where);
  set_number(view, "buffer", document.buffers.size());
  set_number(view, "byteOffset", 0);
  set_number(view, "byteLength", unpacked->size());
  document.buffers.push_back(std::move(*unpacked));
  return {};
}

bool is_required(const Json& document, std::string_view extension) {
  const Json::Array& names = array_member(document, "extensionsRequired");
  return std::any_of(names.begin(), names.end(), [&](const Json& name) {
    return name.string() != nullptr && *name.string() == extension;
  });
}

// The compression of a buffer view, or null, and its extension.
std::pair<const Json*, std::string> compression_of(const Json& view) {
  for (const char* name : {"KHR_meshopt_compression", "EXT_meshopt_compression"})
    if (const Json* packed = view.find({"extensions", name})) return {packed, name};
  return {};
}

Result<void> unpack_views(GltfDocument& document) {
  Json* views = mutable_member(document.json, "bufferViews");
  if (views == nullptr) return {};
  const std::vector<bool> unread = unread_views(document.json);
  double room_bytes = kMaxUnpackedPerByte * static_cast<double>(bytes_of_buffers(document));
  for (std::size_t v = 0; v < unread.size(); ++v) {
    Json& view = (*views->array())[v];
    const bool is_there = bytes_of_view(document, view).has_value();
    const auto [packed, extension] = compression_of(view);
    if (is_there && (packed == nullptr || !is_required(document.json, extension))) continue;
    if (packed == nullptr || unread[v]) {
      set_number(view, "byteOffset", 0);
      set_number(view, "byteLength", 0);
      continue;
    }
    const std::string where = fmt::format("bufferViews[{}]: {}", v, extension);
    if (const auto ok = unpack_view(document, view, *packed, where, room_bytes); !ok.ok())
      return ok;
  }
  return {};
}

// --- Primitives compressed by Draco -------------------------------------------------------------

int components_of(const Json& accessor) {
  const Json* type = accessor.find("type");
  if (type == nullptr || type->string() == nullptr) return 0;
  constexpr std::array kTypes = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  const auto it = std::find(kTypes.begin(), kTypes.end(), *type->string());
  return it == kTypes.end() ? 0 : static_cast<int>(it - kTypes.begin()) + 1;
}

class DracoPrimitives {
 public:
  explicit DracoPrimitives(GltfDocument& document)
      : document_(document), accessors_(array_member(document.json, "accessors")) {}

  Result<void> unpack() {
    Json* meshes = mutable_member(document_.json, "meshes");
    if (meshes == nullptr) return {};
    for (std::size_t m = 0; m < meshes->array()->size(); ++m) {
      Json& mesh = (*meshes->array())[m];
      for (Json& primitive : *mutable_member(mesh, "primitives")->array())
        if (const Json* packed = primitive.find({"extensions", kDraco});
            packed != nullptr && !is_there(primitive))
          if (const auto ok = add(primitive, *packed, fmt::format("mesh {}: {}", m, kDraco));
              !ok.ok())
            return ok;
    }
    if (streams_.empty()) return {};
    auto decoded = decode_draco(streams_, bytes_of_buffers(document_));
    if (!decoded.ok()) return decoded.error();
    place(std::move(*decoded));
    return {};
  }

 private:
  // A primitive, its stream, and the attributes that are read, in the order of the stream's.
  struct User {
    Json* primitive;
    std::size_t stream;
    std::vector<std::string> attributes;
  };

  const Json& accessor_of(const Json& index) const {
    return accessors_[static_cast<std::size_t>(*index.number())];
  }

  // Whether the primitive has its indices and the attributes that are read without compression,
  // too.
  bool is_there(const Json& primitive) const {
    const auto has_data = [&](const Json& index) {
      return accessor_of(index).find("bufferView") != nullptr;
    };
    for (const auto& [name, accessor] : *primitive.find("attributes")->object())
      if (is_unpacked(name) && !has_data(accessor)) return false;
    const Json* indices = primitive.find("indices");
    return indices == nullptr || has_data(*indices);
  }

  Result<void> add(Json& primitive, const Json& packed, const std::string& where) {
    const Json::Array& views = array_member(document_.json, "bufferViews");
    JsonFields fields(packed, where);
    const std::size_t view =
        whole_number(fields, "bufferView", static_cast<double>(views.size()) - 1);
    const Json* ids = fields.any("attributes");
    if (ids == nullptr || ids->object() == nullptr) fields.fail("has no object 'attributes'");
    if (const auto ok = fields.result(); !ok.ok()) return ok;

    User user{&primitive, streams_.size(), {}};
    DracoPrimitive stream{
        where, bytes_of_view(document_, views[view]).value_or(std::span<const std::byte>{}), {}, 0};
    JsonFields id_fields(*ids, where + ": attributes");
    for (const auto& [name, accessor] : *primitive.find("attributes")->object()) {
      if (!is_unpacked(name) || ids->find(name) == nullptr) continue;
      const auto id = static_cast<std::uint32_t>(whole_number(id_fields, name, kMaxUnsigned));
      const Json& stated = accessor_of(accessor);
      const auto type = static_cast<int>(size_member(stated, "componentType"));
      if (components_of(stated) == 0 || component_bytes(type) == 0)
        id_fields.fail(in_quotes(name) + " has an accessor whose type Draco does not have");
      stream.attributes.push_back({id, type, components_of(stated)});
      stream.stated_elements += size_member(stated, "count");
      user.attributes.push_back(name);
    }
    if (const auto ok = id_fields.result(); !ok.ok()) return ok;
    if (const Json* indices = primitive.find("indices"))
      stream.stated_elements += size_member(accessor_of(*indices), "count");
    const auto [known, is_new] =
        known_.try_emplace(std::pair(view, stream.attributes), streams_.size());
    user.stream = known->second;
    if (is_new) streams_.push_back(std::move(stream));
    users_.push_back(std::move(user));
    return {};
  }

  // Lets the primitives refer to new accessors on the decoded bytes.
  void place(DecodedDraco decoded) {
    const std::size_t buffer = document_.buffers.size();
    const auto append_view = [&](std::size_t offset, std::size_t bytes) {
      Json view{Json::Object{}};
      set_number(view, "buffer", buffer);
      set_number(view, "byteOffset", offset);
      set_number(view, "byteLength", bytes);
      return append_to(document_.json, "bufferViews", std::move(*view.object()));
    };
    for (const User& user : users_) {
      const DracoGeometry& geometry = decoded.geometries[user.stream];
      const auto& attributes = streams_[user.stream].attributes;
      Json& to = *mutable_member(*user.primitive, "attributes");
      for (std::size_t a = 0; a < attributes.size(); ++a) {
        Json* index = mutable_member(to, user.attributes[a]);
        Json accessor = accessor_of(*index);
        set_number(accessor, "count", geometry.vertices);
        set_number(accessor, "byteOffset", 0);
        set_number(accessor, "bufferView",
                   append_view(geometry.attribute_offsets[a],
                               geometry.vertices * component_bytes(attributes[a].component_type) *
                                   static_cast<std::size_t>(attributes[a].components)));
        const std::size_t appended =
            append_to(document_.json, "accessors", std::move(*accessor.object()));
        if (geometry.steps[a] > 0) document_.steps[appended] = geometry.steps[a];
        *index = Json(static_cast<double>(appended));
      }
      Json indices{Json::Object{}};
      set_number(indices, "componentType", 5125);
      set_number(indices, "count", geometry.indices);
      set_member(indices, "type", Json(std::string("SCALAR")));
      set_number(indices, "bufferView", append_view(geometry.index_offset, 4 * geometry.indices));
      set_number(*user.primitive, "indices",
                 append_to(document_.json, "accessors", std::move(*indices.object())));
      set_number(*user.primitive, "mode", 4);
    }
    document_.buffers.push_back(std::move(decoded.bytes));
  }

  GltfDocument& document_;
  const Json::Array& accessors_;
  std::vector<User> users_;
  std::vector<DracoPrimitive> streams_;
  std::map<std::pair<std::size_t, std::vector<DracoAttribute>>, std::size_t> known_;
};

}  // namespace

Result<void> unpack_geometry(GltfDocument& document) {
  if (const auto ok = unpack_views(document); !ok.ok()) return ok;
  return DracoPrimitives(document).unpack();
}

}  // namespace clamor
