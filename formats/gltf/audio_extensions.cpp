#include "formats/gltf/audio_extensions.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr std::string_view kModern = "KHR_audio_emitter";

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

const Dialect* dialect_of(const Json& document) {
  for (const Dialect& dialect : kDialects)
    if (const Json* extension = document.find({"extensions", dialect.extension}))
      if (list_in(*extension, dialect.sounds) != nullptr &&
          list_in(*extension, dialect.emitters) != nullptr)
        return &dialect;
  return nullptr;
}

void put(Json::Object& object, std::string_view key, Json value) {
  object.emplace_back(std::string(key), std::move(value));
}

void copy(const Json& from, std::string_view key, Json::Object& to, std::string_view new_key) {
  if (const Json* value = from.find(key)) put(to, new_key, *value);
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

Json* member(Json& object, std::string_view key) {
  if (object.object() == nullptr) return nullptr;
  for (auto& [name, value] : *object.object())
    if (name == key) return &value;
  return nullptr;
}

// Copies the emitters of a node or scene from the old extension.
void rewrite_user(Json& user, const Dialect& dialect) {
  Json* extensions = member(user, "extensions");
  const Json* old = extensions == nullptr ? nullptr : extensions->find(dialect.extension);
  if (old == nullptr || extensions->object() == nullptr) return;
  Json::Object modern;
  copy(*old, dialect.emitters, modern, "emitters");
  copy(*old, dialect.node_emitter, modern, "emitter");
  put(*extensions->object(), kModern, Json(std::move(modern)));
}

}  // namespace

RewrittenAudio rewrite_audio_extensions(Json& document) {
  RewrittenAudio rewritten;
  if (document.find({"extensions", kModern}) != nullptr) return rewritten;
  const Dialect* dialect = dialect_of(document);
  Json* extensions = member(document, "extensions");
  if (dialect == nullptr || extensions->object() == nullptr) return rewritten;
  rewritten.extension = dialect->extension;
  Json modern =
      modern_extension(*extensions->find(dialect->extension), *dialect, rewritten.ignored);
  put(*extensions->object(), kModern, std::move(modern));
  for (const char* users : {"nodes", "scenes"})
    if (Json* list = member(document, users); list != nullptr && list->array() != nullptr)
      for (Json& user : *list->array()) rewrite_user(user, *dialect);
  return rewritten;
}

}  // namespace clamor
