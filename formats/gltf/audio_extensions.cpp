#include "formats/gltf/audio_extensions.h"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "common/text.h"
#include "formats/gltf/hubs_audio.h"
#include "formats/gltf/report_words.h"

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

bool has_list(const Json& object, std::string_view key) {
  const Json* list = object.find(key);
  return list != nullptr && list->array() != nullptr;
}

bool has_lists(const Json& extension, const Dialect& dialect) {
  return has_list(extension, dialect.sounds) && has_list(extension, dialect.emitters);
}

// A document whose lists were dropped by another tool is told by the nodes that use them.
const Dialect* dialect_of(const Json& document) {
  for (const Dialect& dialect : kDialects)
    if (const Json* extension = document.find({"extensions", dialect.extension}))
      if (has_lists(*extension, dialect)) return &dialect;
  for (const Dialect& dialect : kDialects)
    if (std::ranges::any_of(document.list("nodes"), [&](const Json& node) {
          return node.find({"extensions", dialect.extension}) != nullptr;
        }))
      return &dialect;
  return nullptr;
}

// MSFT_audio_emitter has half angles, KHR_audio_emitter full angles.
void copy_half_angle(const Json& from, std::string_view key, Json& to, std::string_view as) {
  if (const double* half = from.number(key))
    to.add(as, Json(std::min(2 * *half, 2 * std::numbers::pi)));
  else
    to.copy(from, key, as);
}

Json positional_of(const Json& emitter, const Dialect& dialect) {
  if (const Json* nested = emitter.find("positional")) return *nested;
  Json positional{Json::Object{}};
  if (dialect.extension == "MSFT_audio_emitter") {
    copy_half_angle(emitter, "innerAngle", positional, "coneInnerAngle");
    copy_half_angle(emitter, "outerAngle", positional, "coneOuterAngle");
    positional.add("facesPlusZ", Json(true));
    // The default model, exponential with a rolloff of 1, is the physical 1 / r.
    if (emitter.text("distanceModel") != "exponential")
      positional.copy(emitter, "distanceModel", "distanceModel");
  } else {
    for (const char* key : {"coneInnerAngle", "coneOuterAngle", "coneOuterGain", "distanceModel"})
      positional.copy(emitter, key, key);
  }
  for (const char* key : {"refDistance", "maxDistance", "rolloffFactor"})
    positional.copy(emitter, key, key);
  return positional;
}

// Adds the private source of an emitter and returns its index; none if it plays nothing.
Json sources_of(const Json& emitter, const std::string& name, Json::Array& sources,
                ImportReport& report) {
  Json source{Json::Object{}};
  if (has_list(emitter, "clips")) {
    const auto clips = emitter.list("clips");
    if (clips.size() > 1)
      report.ignored.push_back(fmt::format(
          "all but the first of {} clips that emitter {} chooses from", clips.size(), name));
    if (!clips.empty()) source.copy(clips.front(), "clip", "audio");
  } else {
    source.copy(emitter, "source", "audio");
  }
  if (source.find("audio") == nullptr) return Json(Json::Array{});
  source.copy(emitter, "loop", "loop");
  source.add("autoplay", Json(true));  // older extensions play unless they say otherwise
  for (const char* key : {"playing", "autoPlay"}) source.copy(emitter, key, "autoplay");
  sources.push_back(std::move(source));
  return Json(Json::Array{Json(static_cast<double>(sources.size() - 1))});
}

Json modern_extension(const Json& extension, const Dialect& dialect, ImportReport& report) {
  if (dialect.own_sources && dialect.emitters == "emitters") return extension;
  Json::Array sounds, sources, emitters;
  for (const Json& sound : extension.list(dialect.sounds)) {
    const auto encodings = sound.list("sources");
    sounds.push_back(encodings.empty() ? sound : encodings.front());  // the first of a clip
  }
  for (const Json& emitter : extension.list(dialect.emitters)) {
    Json modern{Json::Object{}};
    for (const char* key : {"name", "type", "gain", "extensions", "extras"})
      modern.copy(emitter, key, key);
    modern.copy(emitter, "volume", "gain");
    modern.add("sources", sources_of(emitter, emitter.name_or(emitters.size()), sources, report));
    modern.add("positional", positional_of(emitter, dialect));
    emitters.push_back(std::move(modern));
  }
  Json modern{Json::Object{}};
  modern.add("audio", Json(std::move(sounds)));
  modern.add("sources", Json(std::move(sources)));
  modern.add("emitters", Json(std::move(emitters)));
  return modern;
}

// Copies the emitters of a node or scene from the old extension.
void rewrite_user(Json& user, const Dialect& dialect) {
  Json* extensions = user.member("extensions");
  const Json* old = extensions == nullptr ? nullptr : extensions->find(dialect.extension);
  if (old == nullptr) return;
  Json modern{Json::Object{}};
  modern.copy(*old, dialect.emitters, "emitters");
  modern.copy(*old, dialect.node_emitter, "emitter");
  extensions->add(kKhrAudioEmitter, std::move(modern));
}

// Rewrites the first extension of kDialects in the document, unless it has KHR_audio_emitter.
void rewrite_dialect(Json& document, std::vector<std::string>& rewritten, ImportReport& report) {
  if (document.find({"extensions", kKhrAudioEmitter}) != nullptr) return;
  const Dialect* dialect = dialect_of(document);
  if (dialect == nullptr) return;
  rewritten.emplace_back(dialect->extension);
  const Json* old = document.find({"extensions", dialect->extension});
  if (old != nullptr && has_lists(*old, *dialect))
    document.member("extensions")->add(kKhrAudioEmitter, modern_extension(*old, *dialect, report));
  for (const char* users : {"nodes", "scenes"})
    for (Json& user : document.list(users)) rewrite_user(user, *dialect);
}

bool contains_ignoring_case(std::string_view text, std::string_view part) {
  for (std::size_t i = 0; i + part.size() <= text.size(); ++i)
    if (equal_ignoring_case(text.substr(i, part.size()), part)) return true;
  return false;
}

// Places that use an extension, in order: "node 'Radio'", "source 0".
using Users = std::map<std::string, std::vector<std::string>, std::less<>>;

void add_users(const Json& parent, const char* list, const char* kind, Users& users) {
  std::size_t i = 0;
  for (const Json& item : parent.list(list)) {
    const std::string place = fmt::format("{} {}", kind, item.name_or(i++));
    if (const Json* extensions = item.find("extensions"); extensions && extensions->object())
      for (const auto& [extension, value] : *extensions->object())
        users[extension].push_back(place);
  }
}

// "the extension KHR_audio_graph, which Clamor does not read (of node 'Radio' and 2 more)".
void report_unread(const Json& document, const std::vector<std::string>& rewritten,
                   ImportReport& report) {
  Users users;
  for (const Json& name : document.list("extensionsUsed"))
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
  for (const auto& [name, places] : users) {
    if (!is_audio_extension(name) || name == kKhrAudioEmitter || name == "OMI_audio_ogg_vorbis" ||
        name == "OMI_audio_opus" || std::ranges::find(rewritten, name) != rewritten.end())
      continue;
    const bool older = std::ranges::find(kDialects, name, &Dialect::extension) != kDialects.end();
    report.ignored.push_back(fmt::format(
        "the extension {}, which Clamor does not read{}{}", name,
        older ? " beside another audio extension" : "",
        places.empty() ? "" : fmt::format(" (of {}{})", places[0], and_more(places.size() - 1))));
  }
}

}  // namespace

bool is_audio_extension(std::string_view name) {
  return contains_ignoring_case(name, "audio") || contains_ignoring_case(name, "sound");
}

void rewrite_audio_extensions(Json& document, ImportReport& report) {
  std::vector<std::string> rewritten;
  rewrite_dialect(document, rewritten, report);
  rewrite_hubs_components(document, rewritten, report);
  for (const std::string& extension : rewritten)
    report.found.push_back(extension + ", read as KHR_audio_emitter");
  report_unread(document, rewritten, report);
}

}  // namespace clamor
