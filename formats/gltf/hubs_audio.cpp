#include "formats/gltf/hubs_audio.h"

#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "formats/gltf/json_members.h"

namespace clamor {

namespace {

constexpr std::string_view kHubs = "MOZ_hubs_components";

// The list `key` of an object, which is added if it is missing.
Json::Array& list_of(Json& object, std::string_view key) {
  Json* list = member(object, key);
  if (list == nullptr || list->array() == nullptr) {
    put(*object.object(), key, Json(Json::Array{}));
    list = &object.object()->back().second;
  }
  return *list->array();
}

Json& object_of(Json& object, std::string_view key) {
  Json* value = member(object, key);
  if (value == nullptr || value->object() == nullptr) {
    put(*object.object(), key, Json(Json::Object{}));
    value = &object.object()->back().second;
  }
  return *value;
}

void copy_degrees(const Json& from, std::string_view key, Json::Object& to) {
  const Json* value = from.find(key);
  if (value == nullptr) return;
  const double* degrees = value->number();
  put(to, key, degrees == nullptr ? *value : Json(*degrees * std::numbers::pi / 180));
}

Json emitter_of(const Json& audio, const Json& params, std::size_t source) {
  Json::Object emitter;
  const Json* type = params.find("audioType");
  const bool stereo = type != nullptr && type->string() != nullptr && *type->string() == "stereo";
  put(emitter, "type", Json(std::string(stereo ? "global" : "positional")));
  copy(audio, "volume", emitter, "gain");
  copy(params, "gain", emitter, "gain");
  put(emitter, "sources", Json(Json::Array{Json(static_cast<double>(source))}));
  Json::Object positional;
  put(positional, "shapeType", Json(std::string("cone")));
  for (const char* key : {"distanceModel", "refDistance", "rolloffFactor", "coneOuterGain"})
    copy(params, key, positional, key);
  for (const char* key : {"coneInnerAngle", "coneOuterAngle"})
    copy_degrees(params, key, positional);
  put(emitter, "positional", Json(std::move(positional)));
  return Json(std::move(emitter));
}

// Appends the emitter of a component to the lists of KHR_audio_emitter; returns its index.
std::size_t add_emitter(const Json& audio, const Json& params, Json& extension) {
  const auto append = [&extension](std::string_view list, Json entry) {
    Json::Array& entries = list_of(extension, list);
    entries.push_back(std::move(entry));
    return entries.size() - 1;
  };
  Json::Object file, source;
  copy(audio, "src", file, "uri");
  put(source, "audio", Json(static_cast<double>(append("audio", Json(std::move(file))))));
  put(source, "loop", Json(true));  // the default of Hubs
  copy(audio, "loop", source, "loop");
  put(source, "autoplay", Json(true));
  copy(audio, "autoPlay", source, "autoplay");
  return append("emitters", emitter_of(audio, params, append("sources", Json(std::move(source)))));
}

// Why a component is not read; empty if it does not concern sound.
std::string_view reason_to_ignore(std::string_view component) {
  if (component == "audio-zone") return "walls and portals decide here what is heard between rooms";
  if (component == "video") return "the sound of a video is read only as a sound file of its own";
  if (component != "audio" && component != "audio-params" && is_audio_extension(component))
    return "Clamor does not read it";
  return "";
}

// Components that are not read, with their users: "node 'Lounge'".
using Ignored = std::map<std::string, std::vector<std::string>>;

void note_ignored(const Json& user, const std::string& where, Ignored& ignored) {
  const Json* components = user.find({"extensions", kHubs});
  if (components == nullptr || components->object() == nullptr) return;
  const Json* name = user.find("name");
  const bool named = name != nullptr && name->string() != nullptr;
  for (const auto& [component, value] : *components->object())
    if (!reason_to_ignore(component).empty())
      ignored[component].push_back(named ? "node " + in_quotes(*name->string()) : where);
}

// Returns whether the node has a sound, which is appended to the root extension `khr`.
bool rewrite_node(Json& node, Json& khr) {
  Json* extensions = member(node, "extensions");
  const Json* components = extensions == nullptr ? nullptr : extensions->find(kHubs);
  if (components == nullptr || components->object() == nullptr) return false;
  const Json* visible = components->find("visible");
  const Json* audio = components->find("audio");
  const Json* params = components->find("audio-params");
  Json::Object added;
  if (visible != nullptr && extensions->find("KHR_node_visibility") == nullptr)
    put(added, "KHR_node_visibility", *visible);
  const bool sounds = audio != nullptr && audio->object() != nullptr &&
                      extensions->find(kKhrAudioEmitter) == nullptr;
  if (sounds) {
    const std::size_t index = add_emitter(*audio, params == nullptr ? *audio : *params, khr);
    Json::Object reference;
    put(reference, "emitter", Json(static_cast<double>(index)));
    put(added, kKhrAudioEmitter, Json(std::move(reference)));
  }
  for (auto& [name, value] : added) put(*extensions->object(), name, std::move(value));
  return sounds;
}

// Increases the references of a node or scene that point beyond a list of `size` emitters by
// `added`: they dangle, as where a tool has dropped the list, and must not find what was added.
void keep_dangling(Json& user, std::size_t size, std::size_t added) {
  Json* extensions = member(user, "extensions");
  Json* reference = extensions == nullptr ? nullptr : member(*extensions, kKhrAudioEmitter);
  if (reference == nullptr) return;
  const auto shift = [&](Json& index) {
    if (const double* at = index.number(); at != nullptr && *at >= static_cast<double>(size))
      index = Json(*at + static_cast<double>(added));
  };
  if (Json* one = member(*reference, "emitter")) shift(*one);
  if (Json* several = member(*reference, "emitters"); several != nullptr && several->array())
    for (Json& index : *several->array()) shift(index);
}

}  // namespace

void rewrite_hubs_components(Json& document, RewrittenAudio& rewritten) {
  Ignored ignored;
  const Json* known = document.find({"extensions", kKhrAudioEmitter});
  Json khr = known == nullptr || known->object() == nullptr ? Json(Json::Object{}) : *known;
  const std::size_t size = list_of(khr, "emitters").size();
  std::vector<Json*> others;  // that may refer to the emitters which were there before
  if (Json* nodes = member(document, "nodes"); nodes != nullptr && nodes->array() != nullptr)
    for (std::size_t i = 0; i < nodes->array()->size(); ++i) {
      Json& node = (*nodes->array())[i];
      if (!rewrite_node(node, khr)) others.push_back(&node);
      note_ignored(node, fmt::format("node {}", i), ignored);
    }
  if (Json* scenes = member(document, "scenes"); scenes != nullptr && scenes->array() != nullptr)
    for (Json& scene : *scenes->array()) {
      others.push_back(&scene);
      note_ignored(scene, "a scene", ignored);
    }
  if (const std::size_t added = list_of(khr, "emitters").size() - size; added > 0) {
    for (Json* user : others) keep_dangling(*user, size, added);
    rewritten.extensions.emplace_back(kHubs);
    Json& root = object_of(document, "extensions");
    object_of(root, kKhrAudioEmitter) = std::move(khr);
  }
  for (const auto& [component, users] : ignored)
    rewritten.ignored.push_back(fmt::format(
        "{} of {}{}: {}", component, users[0],
        users.size() == 1 ? std::string() : fmt::format(" and {} more", users.size() - 1),
        reason_to_ignore(component)));
}

}  // namespace clamor
