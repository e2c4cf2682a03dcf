#include "formats/gltf/gltf_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr double kMaxInt = std::numeric_limits<int>::max();
constexpr double kMaxSize = 1e15;  // exact in a double and larger than any file

constexpr std::array<std::pair<std::string_view, int>, 7> kTypes = {
    {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}}};

// Walks the document and keeps the first error, after which what it reads means nothing.
class ListReader {
 public:
  explicit ListReader(GltfScene& scene) : scene_(scene), document_(scene.json) {}

  Result<void> run() {
    check_asset();
    each("buffers", [&](const Json& buffer) {
      integer(buffer, "byteLength", 0, kMaxSize, true);
      if (const Json* uri = buffer.find("uri"); uri != nullptr && uri->string() == nullptr)
        fail("'uri' must be a text");
    });
    each("bufferViews", [&](const Json& view) { scene_.views.push_back(read_view(view)); });
    each("accessors",
         [&](const Json& accessor) { scene_.accessors.push_back(read_accessor(accessor)); });
    each("materials",
         [&](const Json& material) { scene_.materials.push_back(material.text("name")); });
    each("meshes", [&](const Json& mesh) { scene_.meshes.push_back(read_mesh(mesh)); });
    each("nodes", [&](const Json& node) { scene_.nodes.push_back(read_node(node)); });
    each("scenes", [&](const Json& scene) { indices(scene, "nodes", "nodes"); });
    index(document_, "scene", "scenes", false);
    if (error_) return *error_;
    for (std::size_t n = 0; n < scene_.nodes.size(); ++n)
      for (const int child : scene_.nodes[n].children)
        scene_.nodes[static_cast<std::size_t>(child)].parent = static_cast<int>(n);
    return {};
  }

 private:
  void check_asset() {
    const Json* version = document_.find({"asset", "version"});
    if (version == nullptr || version->string() == nullptr)
      fail("is no glTF: it has no 'asset' with a 'version'; export the level as glTF 2.0");
    else if (!version->string()->starts_with("2."))
      fail("is glTF " + *version->string() + ", but only 2.x is read; export it as glTF 2.0");
  }

  GltfView read_view(const Json& json) {
    GltfView view;
    view.buffer = index(json, "buffer", "buffers", true);
    view.offset = integer(json, "byteOffset", 0, kMaxSize, false);
    view.length = integer(json, "byteLength", 0, kMaxSize, true);
    view.stride = integer(json, "byteStride", 0, 252, false);
    if (view.stride % 4 != 0)
      fail(fmt::format("'byteStride' is {}, no multiple of 4", view.stride));
    if (error_) return view;
    const Json& buffer = document_.list("buffers")[static_cast<std::size_t>(view.buffer)];
    const std::size_t available = integer(buffer, "byteLength", 0, kMaxSize, true);
    if (view.offset + view.length > available)
      fail(fmt::format("needs bytes {} to {}, but buffer {} has only {}", view.offset,
                       view.offset + view.length, view.buffer, available));
    return view;
  }

  GltfAccessor read_accessor(const Json& json) {
    GltfAccessor accessor;
    accessor.view = index(json, "bufferView", "bufferViews", false);
    accessor.offset = integer(json, "byteOffset", 0, kMaxSize, false);
    accessor.component_type = static_cast<int>(integer(json, "componentType", 5120, 5126, true));
    accessor.count = integer(json, "count", 0, kMaxSize, true);
    if (const Json* normalized = json.find("normalized")) {
      if (normalized->boolean() == nullptr)
        fail("'normalized' must be true or false");
      else
        accessor.normalized = *normalized->boolean();
    }
    const auto type =
        std::ranges::find(kTypes, json.text("type"), [](auto& one) { return one.first; });
    if (type == kTypes.end())
      fail("'type' must be SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4");
    else
      accessor.components = type->second;
    const Json* sparse = json.find("sparse");
    if (sparse == nullptr) return accessor;
    accessor.sparse_count = integer(*sparse, "count", 0, kMaxInt, true);
    const auto part = [&](const char* key, int& view, std::size_t& offset) {
      const Json* values = sparse->find(key);
      if (values == nullptr) return fail(fmt::format("its 'sparse' has no '{}'", key));
      view = index(*values, "bufferView", "bufferViews", true);
      offset = integer(*values, "byteOffset", 0, kMaxInt, false);
    };
    part("indices", accessor.sparse_index_view, accessor.sparse_index_offset);
    part("values", accessor.sparse_value_view, accessor.sparse_value_offset);
    if (!error_)
      accessor.sparse_index_type =
          static_cast<int>(integer(*sparse->find("indices"), "componentType", 5121, 5125, true));
    return accessor;
  }

  GltfMesh read_mesh(const Json& json) {
    GltfMesh mesh{json.text("name"), {}};
    const Json* primitives = json.find("primitives");
    if (primitives == nullptr || primitives->array() == nullptr) fail("has no list 'primitives'");
    for (const Json& primitive : json.list("primitives")) {
      const Json* attributes = primitive.find("attributes");
      if (attributes == nullptr || attributes->object() == nullptr) {
        fail("has a primitive without 'attributes'");
        break;
      }
      GltfPrimitive& made = mesh.primitives.emplace_back();
      for (const auto& [name, value] : *attributes->object())
        made.attributes.emplace_back(name, index(&value, name, "accessors"));
      made.indices = index(primitive, "indices", "accessors", false);
      made.material = index(primitive, "material", "materials", false);
      if (primitive.find("mode") != nullptr)
        made.mode = static_cast<int>(integer(primitive, "mode", 0, 6, false));
    }
    return mesh;
  }

  GltfNode read_node(const Json& json) {
    GltfNode node{json.text("name"), {}, kNone, index(json, "mesh", "meshes", false)};
    node.children = indices(json, "children", "nodes");
    const auto matrix = numbers(json, "matrix", 16), move = numbers(json, "translation", 3),
               turn = numbers(json, "rotation", 4), scale = numbers(json, "scale", 3);
    node.local = transform_of(move, turn, scale);
    for (std::size_t i = 0; i < matrix.size(); ++i)  // both are column-major
      node.local[static_cast<int>(i / 4)][static_cast<int>(i % 4)] = matrix[i];
    return node;
  }

  template <class Read>
  void each(const char* list, Read read) {
    const Json* items = document_.find(list);
    if (items == nullptr || error_) return;
    if (items->array() == nullptr) return fail(in_quotes(list) + " must be a list");
    std::size_t i = 0;
    for (const Json& item : *items->array()) {
      const Json* name = item.find("name");
      const bool named = name != nullptr && name->string() != nullptr;
      thing_ = fmt::format("{}[{}]{}: ", list, i++, named ? " " + in_quotes(*name->string()) : "");
      if (item.object() == nullptr) return fail("must be an object");
      read(item);
      if (error_) return;
    }
    thing_.clear();
  }

  std::size_t integer(const Json& object, std::string_view key, double low, double high,
                      bool needed) {
    const Json* value = object.find(key);
    if (value == nullptr) {
      if (needed) fail(in_quotes(key) + " is missing");
      return 0;
    }
    const double* number = value->number();
    if (number != nullptr && std::floor(*number) == *number && *number >= low && *number <= high)
      return static_cast<std::size_t>(*number);
    fail(fmt::format("'{}' must be a whole number from {:.0f} to {:.0f}", key, low, high));
    return 0;
  }

  int index(const Json* value, std::string_view key, const char* list) {
    const std::size_t count = document_.list(list).size();
    if (const auto index = index_below(value, count)) return static_cast<int>(*index);
    fail(fmt::format("'{}' points to none of the {} {}", key, count, list));
    return kNone;
  }

  int index(const Json& object, std::string_view key, const char* list, bool needed) {
    const Json* value = object.find(key);
    if (value != nullptr) return index(value, key, list);
    if (needed) fail(in_quotes(key) + " is missing");
    return kNone;
  }

  std::vector<int> indices(const Json& object, std::string_view key, const char* list) {
    std::vector<int> found;
    if (const Json* values = object.find(key); values != nullptr && values->array() == nullptr)
      fail(in_quotes(key) + " must be a list");
    for (const Json& value : object.list(key)) found.push_back(index(&value, key, list));
    return found;
  }

  // Empty if there are none.
  std::vector<double> numbers(const Json& object, std::string_view key, std::size_t count) {
    if (object.find(key) == nullptr) return {};
    std::vector<double> found;
    for (const Json& value : object.list(key))
      if (value.number() != nullptr) found.push_back(*value.number());
    if (found.size() == count && object.list(key).size() == count) return found;
    fail(fmt::format("'{}' must be {} numbers", key, count));
    return {};
  }

  void fail(const std::string& what) {
    if (!error_) error_ = Error(thing_ + what + "; correct it or export the level again.");
  }

  GltfScene& scene_;
  const Json& document_;
  std::string thing_;
  std::optional<Error> error_;
};

}  // namespace

Result<void> read_gltf_lists(GltfScene& scene) { return ListReader(scene).run(); }

}  // namespace clamor
