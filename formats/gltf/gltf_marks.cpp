#include "formats/gltf/gltf_marks.h"

#include "formats/level/sidecar.h"

namespace clamor {

namespace {

// Custom properties of older exporters hold 0 or 1 for a checkbox.
bool read_flag(JsonFields& fields, const char* key) {
  const Json* value = fields.any(key);
  if (value == nullptr) return false;
  if (value->boolean() != nullptr) return *value->boolean();
  if (value->number() != nullptr && (*value->number() == 0 || *value->number() == 1))
    return *value->number() == 1;
  fields.fail(in_quotes(key) + " must be true or false");
  return false;
}

}  // namespace

std::string node_in_words(const GltfScene& scene, std::size_t node) {
  const std::string& name = scene.nodes[node].name;
  return "node " + (name.empty() ? std::to_string(node) : in_quotes(name));
}

Result<NodeMarks> read_marks(const GltfScene& scene, std::size_t node) {
  NodeMarks marks;
  const Json* extras = scene.json.element("nodes", node)->find("extras");
  if (extras == nullptr || extras->object() == nullptr) return marks;
  const std::string where = node_in_words(scene, node);
  JsonFields flat(*extras, where + ": extras");
  marks.probe = read_flag(flat, "clamor_probe");
  marks.portal = read_flag(flat, "clamor_portal");
  marks.movable = read_flag(flat, "clamor_movable");
  if (const auto ok = flat.result(); !ok.ok()) return ok.error();
  if (const Json* clamor = extras->find("clamor")) {
    JsonFields fields(*clamor, where + ": extras: clamor");
    marks.probe |= read_flag(fields, "probe");
    marks.portal |= read_flag(fields, "portal");
    marks.movable |= read_flag(fields, "movable");
    marks.is_baked_closed = read_baked_states(fields, marks.material);
    marks.parts = read_portal_parts(fields);
    fields.any("comment");
    if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  }
  return marks;
}

}  // namespace clamor
