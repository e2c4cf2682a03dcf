#include "formats/gltf/audio_extensions.h"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "common/text.h"
#include "formats/gltf/hubs_audio.h"
#include "formats/gltf/json_members.h"

namespace clamor {

namespace {

struct Dialect {
  std::string_view extension;
  std::string_view sounds;        // key of the list of files and buffer views
  std::string_view emitters;      // key of the list of emitters
  std::string_view node_emitter;  // key of the emitter of a node
  bool own_sources;               // has a list of sources, as KHR_audio_emitter does
};

constexpr std::array kDialects = {
    Dialect{"KHR_audio", "audio", "emitters", "emitter", true},
    Dialect{"KHR_audio", "sources", "emitters", "emitter", false},
    Dialect{"MSFT_audio_emitter", "clips", "emitters", "emitter", false},
    Dialect{"OMI_audio_emitter", "audio", "emitters", "emitter", true},
    Dialect{"OMI_audio_emitter", "audioSources", "audioEmitters", "audioEmitter", false},
    Dialect{"OMI_audio_emitter", "audioClips", "audioEmitters", "audioEmitter", false}};

const Json* list_in(const Json& object, std::string_view key) {
  const Json* list = object.find(key);
  return list != nullptr && list->array() != nullptr ? list : nullptr;
}

bool is_used_by_node(const Json& document, std::string_view extension) {
  const Json* nodes = list_in(document, "nodes");
  return nodes != nullptr && std::ranges::any_of(*nodes->array(), [&](const Json& node) {
           return node.find({"extensions", extension}) != nullptr;
         });
}

// A document whose lists were dropped by another tool is told by the nodes that use them.
const Dialect* dialect_of(const Json& document) {
  for (const Dialect& dialect : kDialects)
    if (const Json* extension = document.find({"extensions", dialect.extension}))
      if (list_in(*extension, dialect.sounds) != nullptr &&
          list_in(*extension, dialect.emitters) != nullptr)
        return &dialect;
  for (const Dialect& dialect : kDialects)
    if (is_used_by_node(document, dialect.extension)) return &dialect;
  return nullptr;
}

// Keeps the first encoding of a clip.
Json sound_of(const Json& sound) {
  const Json* first = sound.element("sources", 0);
  return first != nullptr ? *first : sound;
}

// MSFT_audio_emitter has half angles, KHR_audio_emitter full angles.
void copy_half_angle(const Json& from, std::string_view key, Json::Object& to,
                     std::string_view new_key) {
  const Json* value = from.find(key);
  if (value == nullptr) return;
  const double* half = value->number();
  put(to, new_key, half == nullptr ? *value : Json(std::min(2 * *half, 2 * std::numbers::pi)));
}

Json positional_of(const Json& emitter, const Dialect& dialect) {
  if (const Json* nested = emitter.find("positional")) return *nested;
  Json::Object positional;
  if (dialect.extension == "MSFT_audio_emitter") {
    copy_half_angle(emitter, "innerAngle", positional, "coneInnerAngle");
    copy_half_angle(emitter, "outerAngle", positional, "coneOuterAngle");
    put(positional, "facesPlusZ", Json(true));
    // The default model, exponential with a rolloff of 1, is the physical 1 / r.
    const Json* model = emitter.find("distanceModel");
    const std::string* name = model == nullptr ? nullptr : model->string();
    if (model != nullptr && (name == nullptr || *name != "exponential"))
      put(positional, "distanceModel", *model);
  } else {
    for (const char* key : {"coneInnerAngle", "coneOuterAngle", "coneOuterGain", "distanceModel"})
      copy(emitter, key, positional, key);
  }
  for (const char* key : {"refDistance", "maxDistance", "rolloffFactor"})
    copy(emitter, key, positional, key);
  return Json(std::move(positional));
}

// Adds the private source of an emitter and returns its index; none if it plays nothing.
Json sources_of(const Json& emitter, const std::string& name, Json::Array& sources,
                std::vector<std::string>& notes) {
  Json::Object source;
  if (const Json* clips = list_in(emitter, "clips")) {
    if (clips->array()->size() > 1)
      notes.push_back(fmt::format("all but the first of {} clips that emitter {} chooses from",
                                  clips->array()->size(), name));
    if (!clips->array()->empty()) copy(clips->array()->front(), "clip", source, "audio");
  } else {
    copy(emitter, "source", source, "audio");
  }
  copy(emitter, "loop", source, "loop");
  put(source, "autoplay", Json(true));  // older extensions play unless they say otherwise
  for (const char* key : {"playing", "autoPlay"}) copy(emitter, key, source, "autoplay");
  if (source.empty() || source.front().first != "audio") return Json(Json::Array{});
  sources.emplace_back(std::move(source));
  return Json(Json::Array{Json(static_cast<double>(sources.size() - 1))});
}

Json modern_extension(const Json& extension, const Dialect& dialect,
                      std::vector<std::string>& notes) {
  if (dialect.own_sources && dialect.emitters == "emitters") return extension;
  Json::Array sounds, sources, emitters;
  for (const Json& sound : *extension.find(dialect.sounds)->array())
    sounds.push_back(sound_of(sound));
  for (const Json& emitter : *extension.find(dialect.emitters)->array()) {
    Json::Object modern;
    for (const char* key : {"name", "type", "gain", "extensions", "extras"})
      copy(emitter, key, modern, key);
    copy(emitter, "volume", modern, "gain");
    const Json* name = emitter.find("name");
    const bool named = name != nullptr && name->string() != nullptr;
    put(modern, "sources",
        sources_of(emitter, named ? in_quotes(*name->string()) : std::to_string(emitters.size()),
                   sources, notes));
    put(modern, "positional", positional_of(emitter, dialect));
    emitters.emplace_back(std::move(modern));
  }
  Json::Object modern;
  put(modern, "audio", Json(std::move(sounds)));
  put(modern, "sources", Json(std::move(sources)));
  put(modern, "emitters", Json(std::move(emitters)));
  return Json(std::move(modern));
}

// Copies the emitters of a node or scene from the old extension.
void rewrite_user(Json& user, const Dialect& dialect) {
  Json* extensions = member(user, "extensions");
  const Json* old = extensions == nullptr ? nullptr : extensions->find(dialect.extension);
  if (old == nullptr || extensions->object() == nullptr) return;
  Json::Object modern;
  copy(*old, dialect.emitters, modern, "emitters");
  copy(*old, dialect.node_emitter, modern, "emitter");
  put(*extensions->object(), kKhrAudioEmitter, Json(std::move(modern)));
}

// Rewrites the first extension of kDialects in the document, unless it has KHR_audio_emitter.
void rewrite_dialect(Json& document, RewrittenAudio& rewritten) {
  if (document.find({"extensions", kKhrAudioEmitter}) != nullptr) return;
  const Dialect* dialect = dialect_of(document);
  if (dialect == nullptr) return;
  rewritten.extensions.emplace_back(dialect->extension);
  const Json* old = document.find({"extensions", dialect->extension});
  if (old != nullptr && list_in(*old, dialect->sounds) != nullptr &&
      list_in(*old, dialect->emitters) != nullptr) {
    Json modern = modern_extension(*old, *dialect, rewritten.ignored);
    put(*member(document, "extensions")->object(), kKhrAudioEmitter, std::move(modern));
  }
  for (const char* users : {"nodes", "scenes"})
    if (Json* list = member(document, users); list != nullptr && list->array() != nullptr)
      for (Json& user : *list->array()) rewrite_user(user, *dialect);
}

bool contains_ignoring_case(std::string_view text, std::string_view part) {
  for (std::size_t i = 0; i + part.size() <= text.size(); ++i)
    if (equal_ignoring_case(text.substr(i, part.size()), part)) return true;
  return false;
}

// Places that use an extension, in order: "node 'Radio'", "source 0".
using Users = std::map<std::string, std::vector<std::string>, std::less<>>;

void add_users(const Json& parent, const char* list, const char* kind, Users& users) {
  const Json* items = list_in(parent, list);
  if (items == nullptr) return;
  for (std::size_t i = 0; i < items->array()->size(); ++i) {
    const Json& item = (*items->array())[i];
    const Json* extensions = item.find("extensions");
    if (extensions == nullptr || extensions->object() == nullptr) continue;
    const Json* name = item.find("name");
    const bool named = name != nullptr && name->string() != nullptr;
    for (const auto& [extension, value] : *extensions->object())
      users[extension].push_back(
          fmt::format("{} {}", kind, named ? in_quotes(*name->string()) : std::to_string(i)));
  }
}

// "the extension KHR_audio_graph, which Clamor does not read (of node 'Radio' and 2 more)".
std::vector<std::string> unread_audio_extensions(const Json& document,
                                                 const RewrittenAudio& rewritten) {
  Users users;
  if (const Json* used = list_in(document, "extensionsUsed"))
    for (const Json& name : *used->array())
      if (name.string() != nullptr) users[*name.string()];
  if (const Json* root = document.find("extensions"); root != nullptr && root->object() != nullptr)
    for (const auto& [name, value] : *root->object()) users[name];
  add_users(document, "nodes", "node", users);
  add_users(document, "scenes", "scene", users);
  if (const Json* modern = document.find({"extensions", kKhrAudioEmitter})) {
    add_users(*modern, "emitters", "emitter", users);
    add_users(*modern, "sources", "source", users);
    add_users(*modern, "audio", "audio", users);
  }
  std::vector<std::string> unread;
  for (const auto& user : users) {
    const std::string& name = user.first;
    const std::vector<std::string>& places = user.second;
    if (!is_audio_extension(name) || name == kKhrAudioEmitter || name == "OMI_audio_ogg_vorbis" ||
        name == "OMI_audio_opus" ||
        std::ranges::find(rewritten.extensions, name) != rewritten.extensions.end())
      continue;
    const bool older = std::ranges::any_of(
        kDialects, [&](const Dialect& dialect) { return dialect.extension == name; });
    std::string line = fmt::format("the extension {}, which Clamor does not read{}", name,
                                   older ? " beside another audio extension" : "");
    if (!places.empty()) line += " (of " + places[0];
    if (places.size() > 1) line += fmt::format(" and {} more", places.size() - 1);
    unread.push_back(line + (places.empty() ? "" : ")"));
  }
  return unread;
}

}  // namespace

bool is_audio_extension(std::string_view name) {
  return contains_ignoring_case(name, "audio") || contains_ignoring_case(name, "sound");
}

RewrittenAudio rewrite_audio_extensions(Json& document) {
  RewrittenAudio rewritten;
  rewrite_dialect(document, rewritten);
  rewrite_hubs_components(document, rewritten);
  for (std::string& line : unread_audio_extensions(document, rewritten))
    rewritten.ignored.push_back(std::move(line));
  return rewritten;
}

}  // namespace clamor
