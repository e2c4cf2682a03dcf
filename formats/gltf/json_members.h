// json_members.h: changes members of JSON objects, for the rewriting of glTF extensions.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "formats/files/json.h"

namespace clamor {

// The first member of that name; null if there is none or `object` is no object.
inline Json* member(Json& object, std::string_view key) {
  if (object.object() == nullptr) return nullptr;
  for (auto& [name, value] : *object.object())
    if (name == key) return &value;
  return nullptr;
}

inline void put(Json::Object& object, std::string_view key, Json value) {
  object.emplace_back(std::string(key), std::move(value));
}

inline void copy(const Json& from, std::string_view key, Json::Object& to,
                 std::string_view new_key) {
  if (const Json* value = from.find(key)) put(to, new_key, *value);
}

}  // namespace clamor
