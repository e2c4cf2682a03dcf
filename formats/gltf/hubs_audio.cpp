#include "formats/gltf/hubs_audio.h"

#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "formats/gltf/report_words.h"

namespace clamor {

namespace {

constexpr std::string_view kHubs = "MOZ_hubs_components";

// The list `key` of an object, which is added if it is missing.
Json::Array& list_of(Json& object, std::string_view key) {
  const Json* list = object.find(key);
  if (list == nullptr || list->array() == nullptr) object.add(key, Json(Json::Array{}));
  return *object.member(key)->array();
}

Json& object_of(Json& object, std::string_view key) {
  const Json* value = object.find(key);
  if (value == nullptr || value->object() == nullptr) object.add(key, Json(Json::Object{}));
  return *object.member(key);
}

Json emitter_of(const Json& audio, const Json& params, std::size_t source) {
  Json emitter{Json::Object{}};
  const bool stereo = params.text("audioType") == "stereo";
  emitter.add("type", Json(std::string(stereo ? "global" : "positional")));
  emitter.copy(audio, "volume", "gain");
  emitter.copy(params, "gain", "gain");
  emitter.add("sources", Json(Json::Array{Json(static_cast<double>(source))}));
  Json positional{Json::Object{}};
  positional.add("shapeType", Json(std::string("cone")));
  for (const char* key : {"distanceModel", "refDistance", "rolloffFactor", "coneOuterGain"})
    positional.copy(params, key, key);
  for (const char* key : {"coneInnerAngle", "coneOuterAngle"})
    if (const double* degrees = params.number(key))
      positional.add(key, Json(*degrees * std::numbers::pi / 180));
    else
      positional.copy(params, key, key);
  emitter.add("positional", std::move(positional));
  return emitter;
}

// Appends the emitter of a component to the lists of KHR_audio_emitter; returns its index.
std::size_t add_emitter(const Json& audio, const Json& params, Json& extension) {
  const auto append = [&extension](std::string_view list, Json entry) {
    Json::Array& entries = list_of(extension, list);
    entries.push_back(std::move(entry));
    return entries.size() - 1;
  };
  Json file{Json::Object{}}, source{Json::Object{}};
  file.copy(audio, "src", "uri");
  source.add("audio", Json(static_cast<double>(append("audio", std::move(file)))));
  source.add("loop", Json(true));  // the default of Hubs
  source.copy(audio, "loop", "loop");
  source.add("autoplay", Json(true));
  source.copy(audio, "autoPlay", "autoplay");
  return append("emitters", emitter_of(audio, params, append("sources", std::move(source))));
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
  Json* extensions = node.member("extensions");
  const Json* known = extensions == nullptr ? nullptr : extensions->find(kHubs);
  if (known == nullptr || known->object() == nullptr) return false;
  const Json components = *known;
  if (extensions->find("KHR_node_visibility") == nullptr)
    extensions->copy(components, "visible", "KHR_node_visibility");
  const Json* audio = components.find("audio");
  if (audio == nullptr || audio->object() == nullptr ||
      extensions->find(kKhrAudioEmitter) != nullptr)
    return false;
  const Json* params = components.find("audio-params");
  const std::size_t index = add_emitter(*audio, params == nullptr ? *audio : *params, khr);
  object_of(*extensions, kKhrAudioEmitter).add("emitter", Json(static_cast<double>(index)));
  return true;
}

// Increases the references of a node or scene that point beyond a list of `size` emitters by
// `added`: they dangle, as where a tool has dropped the list, and must not find what was added.
void keep_dangling(Json& user, std::size_t size, std::size_t added) {
  Json* extensions = user.member("extensions");
  Json* reference = extensions == nullptr ? nullptr : extensions->member(kKhrAudioEmitter);
  if (reference == nullptr) return;
  const auto shift = [&](Json& index) {
    if (const double* at = index.number(); at != nullptr && *at >= static_cast<double>(size))
      index = Json(*at + static_cast<double>(added));
  };
  if (Json* one = reference->member("emitter")) shift(*one);
  for (Json& index : reference->list("emitters")) shift(index);
}

}  // namespace

void rewrite_hubs_components(Json& document, std::vector<std::string>& rewritten,
                             ImportReport& report) {
  Ignored ignored;
  const Json* known = document.find({"extensions", kKhrAudioEmitter});
  Json khr = known == nullptr || known->object() == nullptr ? Json(Json::Object{}) : *known;
  const std::size_t size = list_of(khr, "emitters").size();
  std::vector<Json*> others;  // that may refer to the emitters which were there before
  std::size_t i = 0;
  for (Json& node : document.list("nodes")) {
    if (!rewrite_node(node, khr)) others.push_back(&node);
    note_ignored(node, fmt::format("node {}", i++), ignored);
  }
  for (Json& scene : document.list("scenes")) {
    others.push_back(&scene);
    note_ignored(scene, "a scene", ignored);
  }
  if (const std::size_t added = list_of(khr, "emitters").size() - size; added > 0) {
    for (Json* user : others) keep_dangling(*user, size, added);
    rewritten.emplace_back(kHubs);
    object_of(object_of(document, "extensions"), kKhrAudioEmitter) = std::move(khr);
  }
  for (const auto& [component, users] : ignored)
    report.ignored.push_back(fmt::format("{} of {}{}: {}", component, users[0],
                                         and_more(users.size() - 1), reason_to_ignore(component)));
}

}  // namespace clamor
