#include "formats/gltf/kept_extensions.h"

#include <string_view>

namespace clamor {

namespace {

Json* member_of(Json& object, std::string_view key) {
  if (object.object() == nullptr) return nullptr;
  for (auto& [name, value] : *object.object())
    if (name == key) return &value;
  return nullptr;
}

// Moves the extensions of a material or node, and returns whether an emitter has no list.
bool restore(Json& owner, const Json& lists) {
  const Json* kept = owner.find({"extras", "gltfExtensions"});
  if (kept == nullptr || kept->object() == nullptr) return false;
  const Json::Object moved = *kept->object();
  if (member_of(owner, "extensions") == nullptr)
    owner.object()->emplace_back("extensions", Json(Json::Object{}));
  Json* extensions = member_of(owner, "extensions");
  if (extensions->object() == nullptr) return false;
  bool is_lost = false;
  for (const auto& [name, value] : moved) {
    const bool has_no_list =
        name.find("_audio") != std::string::npos && lists.find(name) == nullptr;
    is_lost |= has_no_list;
    if (!has_no_list && extensions->find(name) == nullptr)
      extensions->object()->emplace_back(name, value);
  }
  return is_lost;
}

}  // namespace

std::vector<std::string> restore_kept_extensions(Json& document) {
  const Json* root = document.find("extensions");
  const Json lists = root == nullptr ? Json() : *root;
  std::vector<std::string> lost;
  for (const char* list : {"materials", "nodes"})
    if (Json* owners = member_of(document, list); owners != nullptr && owners->array() != nullptr)
      for (Json& owner : *owners->array()) {
        if (!restore(owner, lists)) continue;
        const Json* name = owner.find("name");
        lost.push_back(name == nullptr || name->string() == nullptr ? "" : *name->string());
      }
  return lost;
}

}  // namespace clamor
