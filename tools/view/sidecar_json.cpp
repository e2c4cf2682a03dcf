#include "tools/view/sidecar_json.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "common/utf8_path.h"

namespace clamor::sidecar_json {

namespace {

// The shortest number that is read as the same float: transmissions of walls span many decades.
Json exact_number(double value) {
  const std::string text = fmt::format("{}", static_cast<float>(value));
  double shortest = 0;
  std::from_chars(text.data(), text.data() + text.size(), shortest);
  return Json(shortest);
}

Json* find(Json& object, std::string_view key) { return const_cast<Json*>(object.find(key)); }

// One number if all bands are alike.
Json bands(const Bands& values, Json (*number_of)(double)) {
  if (std::ranges::all_of(values, [&](float value) { return value == values[0]; }))
    return number_of(static_cast<double>(values[0]));
  Json::Array list;
  for (const float value : values) list.push_back(number_of(static_cast<double>(value)));
  return Json(std::move(list));
}

void write_entries(const Json& value, std::string& out) {
  const auto* const list = value.array();
  const auto* const object = value.object();
  const std::size_t count = list != nullptr ? list->size() : object->size();
  out += list != nullptr ? "[" : "{";
  for (std::size_t i = 0; i < count; ++i) {
    out += i == 0 ? "\n    " : ",\n    ";
    if (list == nullptr) out += dump_json(Json((*object)[i].first)) + ": ";
    out += dump_json(list != nullptr ? (*list)[i] : (*object)[i].second);
  }
  if (count > 0) out += "\n  ";
  out += list != nullptr ? "]" : "}";
}

}  // namespace

Json number(double value) { return Json(std::round(value * 1e4) / 1e4); }

Json vector(const Vec3& value) {
  return Json(Json::Array{number(value.x), number(value.y), number(value.z)});
}

Json bands(const Bands& values) { return bands(values, number); }

void set(Json& object, const std::string& key, Json value) {
  if (Json* const known = find(object, key))
    *known = std::move(value);
  else
    object.object()->emplace_back(key, std::move(value));
}

void unset(Json& object, std::string_view key) {
  std::erase_if(*object.object(), [&](const auto& member) { return member.first == key; });
}

Json::Array& list_of(Json& sidecar, const std::string& key) {
  if (find(sidecar, key) == nullptr) set(sidecar, key, Json(Json::Array{}));
  return *find(sidecar, key)->array();
}

void set_rule(Json& sidecar, const std::string& material, Json values) {
  if (find(sidecar, "materials") == nullptr) set(sidecar, "materials", Json(Json::Object{}));
  Json::Object& rules = *find(sidecar, "materials")->object();
  std::erase_if(rules, [&](const auto& rule) { return rule.first == material; });
  rules.emplace(rules.begin(), material, std::move(values));
}

Json json_of(const Material& material) {
  Json::Object values;
  values.emplace_back("absorption", bands(material.absorption));
  values.emplace_back("scattering", bands(material.scattering));
  // A mirror has no exponent.
  if (material.phong != same_in_all_bands(kMirrorExponent))
    values.emplace_back("phong", bands(material.phong));
  if (material.transmission != Bands{})
    values.emplace_back("transmission", bands(material.transmission, exact_number));
  if (material.rows_m > 0)
    values.emplace_back("rows_m", exact_number(static_cast<double>(material.rows_m)));
  return Json(std::move(values));
}

Json json_of(const ListenerSpec& listener, const Vec3& origin_m) {
  return Json(Json::Object{{"name", Json(listener.name)},
                           {"at", vector(listener.at_m + origin_m)},
                           {"yaw", number(listener.yaw_deg)},
                           {"pitch", number(listener.pitch_deg)}});
}

void write_portal(Json& entry, const PortalSpec& spec, const Vec3& origin_m) {
  const Portal& portal = spec.portal;
  if (portal.name.empty())
    unset(entry, "name");
  else
    set(entry, "name", Json(portal.name));
  set(entry, "at", vector(portal.centre_m + origin_m));
  set(entry, "size",
      Json(Json::Array{number(2 * length(portal.half_u_m)), number(2 * length(portal.half_v_m))}));
  set(entry, "facing", vector(normal_of(portal)));
  for (const char* const key : {"baked", "material", "parts"}) unset(entry, key);
  if (spec.parts) {
    Json::Array names;
    for (const std::string& name : *spec.parts) names.emplace_back(name);
    set(entry, "parts", Json(std::move(names)));
  }
  if (!portal.is_baked_closed) return;
  set(entry, "baked", Json(std::string("both")));
  set(entry, "material", Json(spec.material));
}

Json* entry_of(Json& sidecar, const std::string& name) {
  for (Json& entry : list_of(sidecar, "emitters")) {
    const Json* const known = entry.find("name");
    if (known != nullptr && known->string() != nullptr && *known->string() == name) return &entry;
    const Json* const signal = entry.find("signal");
    if (known == nullptr && signal != nullptr && signal->string() != nullptr &&
        path_of(*signal->string()).stem() == name)
      return &entry;
  }
  return nullptr;
}

std::string text_of(const Json& sidecar) {
  std::string out = "{";
  bool is_first = true;
  for (const auto& [key, value] : *sidecar.object()) {
    out += is_first ? "\n  " : ",\n  ";
    is_first = false;
    out += dump_json(Json(key)) + ": ";
    if (value.array() != nullptr || (value.object() != nullptr && key == "materials"))
      write_entries(value, out);
    else
      out += dump_json(value);
  }
  return out + "\n}\n";
}

}  // namespace clamor::sidecar_json
