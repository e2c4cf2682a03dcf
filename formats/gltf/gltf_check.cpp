#include "formats/gltf/gltf_check.h"

#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr double kMaxInt = std::numeric_limits<int>::max();
constexpr double kMaxSize = 1e15;  // exact in a double and larger than any file

// Walks the document and keeps the first error.
class Checker {
 public:
  explicit Checker(const Json& document) : document_(document) {
    for (const char* list :
         {"buffers", "bufferViews", "accessors", "materials", "meshes", "nodes", "scenes"})
      if (const Json* items = document.find(list); items != nullptr && items->array() != nullptr)
        lists_.emplace_back(list, items->array());
  }

  Result<void> run() {
    check_asset();
    each("buffers", [&](const Json& buffer) {
      integer(buffer, "byteLength", 0, kMaxSize, true);
      if (const Json* uri = buffer.find("uri"); uri != nullptr && uri->string() == nullptr)
        fail("'uri' must be a text");
    });
    each("bufferViews", [&](const Json& view) { check_view(view); });
    each("accessors", [&](const Json& accessor) { check_accessor(accessor); });
    each("materials", [&](const Json&) {});
    each("meshes", [&](const Json& mesh) { check_mesh(mesh); });
    each("nodes", [&](const Json& node) { check_node(node); });
    each("scenes", [&](const Json& scene) { indices(scene, "nodes", "nodes"); });
    thing_.clear();
    index(document_, "scene", "scenes", false);
    if (error_) return *error_;
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

  void check_view(const Json& view) {
    index(view, "buffer", "buffers", true);
    const double offset = integer(view, "byteOffset", 0, kMaxSize, false);
    const double length = integer(view, "byteLength", 0, kMaxSize, true);
    const double stride = integer(view, "byteStride", 0, 252, false);
    if (std::fmod(stride, 4) != 0)
      fail(fmt::format("'byteStride' is {}, no multiple of 4", stride));
    if (error_) return;
    const auto buffer = static_cast<std::size_t>(*view.find("buffer")->number());
    const double available = *list_named("buffers")[buffer].find("byteLength")->number();
    if (offset + length > available)
      fail(fmt::format("needs bytes {:.0f} to {:.0f}, but buffer {} has only {:.0f}", offset,
                       offset + length, buffer, available));
  }

  void check_accessor(const Json& accessor) {
    index(accessor, "bufferView", "bufferViews", false);
    integer(accessor, "byteOffset", 0, kMaxSize, false);
    integer(accessor, "componentType", 5120, 5126, true);
    integer(accessor, "count", 0, kMaxSize, true);
    kind(
        accessor, "normalized", [](const Json& value) { return value.boolean() != nullptr; },
        "true or false");
    const Json* sparse = accessor.find("sparse");
    if (sparse == nullptr) return;
    integer(*sparse, "count", 0, kMaxInt, true);
    for (const char* part : {"indices", "values"}) {
      const Json* values = sparse->find(part);
      if (values == nullptr) return fail(fmt::format("its 'sparse' has no '{}'", part));
      index(*values, "bufferView", "bufferViews", true);
      integer(*values, "byteOffset", 0, kMaxInt, false);
    }
    integer(*sparse->find("indices"), "componentType", 5121, 5125, true);
  }

  void check_mesh(const Json& mesh) {
    const Json* primitives = mesh.find("primitives");
    if (primitives == nullptr || primitives->array() == nullptr)
      return fail("has no list 'primitives'");
    for (const Json& primitive : *primitives->array()) {
      const Json* attributes = primitive.find("attributes");
      if (attributes == nullptr || attributes->object() == nullptr)
        return fail("has a primitive without 'attributes'");
      for (const auto& [name, value] : *attributes->object()) check_index(value, name, "accessors");
      index(primitive, "indices", "accessors", false);
      index(primitive, "material", "materials", false);
      integer(primitive, "mode", 0, 6, false);
    }
  }

  void check_node(const Json& node) {
    index(node, "mesh", "meshes", false);
    indices(node, "children", "nodes");
    numbers(node, "matrix", 16);
    numbers(node, "translation", 3);
    numbers(node, "rotation", 4);
    numbers(node, "scale", 3);
  }

  template <class Check>
  void each(const char* list, Check check) {
    const Json* items = document_.find(list);
    if (items == nullptr || error_) return;
    if (items->array() == nullptr) return fail(in_quotes(list) + " must be a list");
    std::size_t i = 0;
    for (const Json& item : *items->array()) {
      const Json* name = item.find("name");
      const bool named = name != nullptr && name->string() != nullptr;
      thing_ = fmt::format("{}[{}]{}: ", list, i++, named ? " " + in_quotes(*name->string()) : "");
      if (item.object() == nullptr) return fail("must be an object");
      check(item);
      if (error_) return;
    }
    thing_.clear();
  }

  template <class Is>
  void kind(const Json& object, std::string_view key, Is is, const char* wanted) {
    const Json* value = object.find(key);
    if (value != nullptr && !is(*value)) fail(in_quotes(key) + " must be " + wanted);
  }

  double integer(const Json& object, std::string_view key, double low, double high, bool needed) {
    const Json* value = object.find(key);
    if (value == nullptr) {
      if (needed) fail(in_quotes(key) + " is missing");
      return 0;
    }
    const double* number = value->number();
    if (number == nullptr || std::floor(*number) != *number || *number < low || *number > high) {
      fail(fmt::format("'{}' must be a whole number from {:.0f} to {:.0f}", key, low, high));
      return 0;
    }
    return *number;
  }

  const Json::Array& list_named(std::string_view name) const {
    static const Json::Array kEmpty;
    for (const auto& [list, items] : lists_)
      if (list == name) return *items;
    return kEmpty;
  }

  void check_index(const Json& value, std::string_view key, const char* list) {
    const double* number = value.number();
    const std::size_t count = list_named(list).size();
    if (number == nullptr || std::floor(*number) != *number || *number < 0 ||
        *number >= static_cast<double>(count))
      fail(fmt::format("'{}' points to none of the {} {}", key, count, list));
  }

  void index(const Json& object, std::string_view key, const char* list, bool needed) {
    const Json* value = object.find(key);
    if (value != nullptr)
      check_index(*value, key, list);
    else if (needed)
      fail(in_quotes(key) + " is missing");
  }

  void indices(const Json& object, std::string_view key, const char* list) {
    const Json* values = object.find(key);
    if (values == nullptr) return;
    if (values->array() == nullptr) return fail(in_quotes(key) + " must be a list");
    for (const Json& value : *values->array()) check_index(value, key, list);
  }

  void numbers(const Json& object, std::string_view key, std::size_t count) {
    const Json* values = object.find(key);
    if (values == nullptr) return;
    bool ok = values->array() != nullptr && values->array()->size() == count;
    if (ok)
      for (const Json& value : *values->array()) ok = ok && value.number() != nullptr;
    if (!ok) fail(fmt::format("'{}' must be {} numbers", key, count));
  }

  void fail(const std::string& what) {
    if (!error_) error_ = Error(thing_ + what + "; correct it or export the level again.");
  }

  const Json& document_;
  std::vector<std::pair<std::string_view, const Json::Array*>> lists_;
  std::string thing_;
  std::optional<Error> error_;
};

// Returns only the members in `keys`.
Json only(const Json& object, std::initializer_list<std::string_view> keys) {
  Json::Object kept;
  for (const std::string_view key : keys)
    if (const Json* value = object.find(key)) kept.emplace_back(key, *value);
  return Json(std::move(kept));
}

template <class Reduce>
void copy_list(const Json& document, const char* list, Json::Object& out, Reduce reduce) {
  const Json* items = document.find(list);
  if (items == nullptr) return;
  Json::Array kept;
  for (const Json& item : *items->array()) kept.push_back(reduce(item));
  out.emplace_back(list, Json(std::move(kept)));
}

}  // namespace

Result<void> check_gltf(const Json& document) { return Checker(document).run(); }

std::string essential_gltf(const Json& document) {
  Json::Object out;
  out.emplace_back("asset", only(*document.find("asset"), {"version"}));
  if (const Json* scene = document.find("scene")) out.emplace_back("scene", *scene);
  copy_list(document, "bufferViews", out, [](const Json& view) {
    return only(view, {"buffer", "byteOffset", "byteLength", "byteStride"});
  });
  copy_list(document, "accessors", out, [](const Json& accessor) {
    return only(accessor, {"bufferView", "byteOffset", "componentType", "count", "type",
                           "normalized", "sparse"});
  });
  copy_list(document, "materials", out,
            [](const Json& material) { return only(material, {"name"}); });
  copy_list(document, "meshes", out, [](const Json& mesh) {
    Json kept = only(mesh, {"name"});
    Json::Object& object = *kept.object();
    copy_list(mesh, "primitives", object, [](const Json& primitive) {
      return only(primitive, {"attributes", "indices", "material", "mode"});
    });
    return kept;
  });
  copy_list(document, "nodes", out, [](const Json& node) {
    return only(node, {"name", "children", "mesh", "matrix", "translation", "rotation", "scale"});
  });
  copy_list(document, "scenes", out, [](const Json& scene) { return only(scene, {"nodes"}); });
  return dump_json(Json(std::move(out)));
}

}  // namespace clamor
