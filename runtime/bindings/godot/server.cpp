#include "runtime/bindings/godot/server.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "runtime/bindings/godot/baker.h"
#include "runtime/bindings/godot/engine.h"
#include "runtime/bindings/godot/listener_stream.h"
#include "runtime/bindings/godot/world.h"

namespace clamor::godot {
namespace {

using Arguments = const Value* const*;

World& world() { return World::get(); }

// --- Levels
// ---------------------------------------------------------------------------------------

Value open_level(void*, Arguments a) {
  return world().open_level(*a[0], a[1]->to_text(), a[2]->to_text());
}

Value close_level(void*, Arguments a) {
  world().close_level(a[0]->to_int());
  return {};
}

Value level_state(void*, Arguments a) {
  const auto level = world().level(a[0]->to_int());
  return level == nullptr ? int(kFailed) : level->state.load();
}

// The level with this number if it is open, otherwise null.
std::shared_ptr<Level> opened(const Value& number) {
  auto level = world().level(number.to_int());
  return level != nullptr && level->state == kOpen ? level : nullptr;
}

Value array(const std::vector<std::string>& texts) {
  const Value array = Value::empty(kArray);
  for (const std::string& text : texts) array.call("append", {text});
  return array;
}

Value level_info(void*, Arguments a) {
  Value dictionary = Value::empty(kDictionary);
  const auto level = opened(*a[0]);
  if (level == nullptr) return dictionary;
  dictionary.set("sources", Integer(level->sources));
  dictionary.set("emitters", array(level->emitters));
  dictionary.set("portals", array(level->portals));
  dictionary.set("parts", array(level->parts));
  return dictionary;
}

// Calls change(level, index) on the publisher's thread, by the index of a name in an open level;
// false if there is none.
template <class Change>
bool change_named(Arguments a, std::vector<std::string> Level::*names, const Change& change) {
  const auto level = opened(*a[0]);
  if (level == nullptr) return false;
  const auto& all = level.get()->*names;
  const auto found = std::ranges::find(all, a[1]->to_text());
  if (found == all.end()) return false;
  world().publisher().run([change, handle = level->handle,
                           index = std::uint32_t(found - all.begin())] { change(handle, index); });
  return true;
}

// False where the level has no emitter of this name, or is not open.
Value set_emitter(void*, Arguments a) {
  auto options = sized<clamor_emitter_options>();
  options.has_gain = 1;
  options.gain = std::clamp(a[2]->to_float(), 0.0, 1.0);
  options.is_muted = a[3]->to_bool();
  return change_named(a, &Level::emitters, [options](clamor_level level, std::uint32_t emitter) {
    clamor_change_emitter(world().context(), level, emitter, &options);
  });
}

Value set_portal(void*, Arguments a) {
  const double openness = a[2]->to_float();
  return change_named(a, &Level::portals, [openness](clamor_level level, std::uint32_t portal) {
    clamor_set_portal(world().context(), level, portal, openness);
  });
}

// --- Movable parts
// --------------------------------------------------------------------------------

Value find_part(void*, Arguments a) {
  const auto level = opened(*a[0]);
  if (level == nullptr) return 0;
  const auto found = std::ranges::find(level->parts, a[1]->to_text());
  if (found == level->parts.end()) return 0;
  return world().keep_part(level->part_handles[std::size_t(found - level->parts.begin())]);
}

Value add_part(void*, Arguments a) {
  if (!world().open()) return 0;
  auto options = sized<clamor_part_options>();
  std::fill_n(options.transmission, 8, (*a[1])["transmission"].to_float());
  std::fill_n(options.absorption, 8, (*a[1])["absorption"].to_float());
  options.pose = pose_of(*a[2], *a[3]);
  const Integer number = world().keep_part(0);
  world().change_part(number, [options, vertices = a[0]->to_floats(kPackedVector3Array, 3),
                               node = (*a[1])["node"].to_text()](clamor_part& handle) mutable {
    std::vector<std::uint32_t> indices(vertices.size() / 3);
    std::iota(indices.begin(), indices.end(), 0u);
    options.vertices_m = vertices.data();
    options.indices = indices.data();
    options.vertices = std::uint32_t(indices.size());
    options.triangles = options.vertices / 3;
    clamor_error error;
    if (clamor_add_part(world().context(), &options, &handle, &error) != CLAMOR_OK)
      world().report(node, error.sentence);
  });
  return number;
}

Value move_part(void*, Arguments a) {
  world().change_part(a[0]->to_int(), [pose = pose_of(*a[1], *a[2])](clamor_part handle) {
    clamor_move_part(world().context(), handle, &pose);
  });
  return {};
}

Value enable_part(void*, Arguments a) {
  world().change_part(a[0]->to_int(), [is_enabled = a[1]->to_bool()](clamor_part handle) {
    clamor_enable_part(world().context(), handle, is_enabled);
  });
  return {};
}

Value remove_part(void*, Arguments a) {
  world().remove_part(a[0]->to_int());
  return {};
}

// --- Listeners
// ------------------------------------------------------------------------------------

Value create_listener(void*, Arguments a) {
  return world().create_listener(a[0]->to_int(), *a[1], a[2]->to_text());
}

Value listener_stream(void*, Arguments a) {
  return make_listener_stream(world().listener(a[0]->to_int()));
}

Value listener_effect(void*, Arguments a) {
  return make_listener_effect(world().listener(a[0]->to_int()));
}

Value enter_level(void*, Arguments a) {
  world().enter_level(a[0]->to_int(), a[1]->to_int());
  return {};
}

Value move_listener(void*, Arguments a) {
  world().move_listener(a[0]->to_int(), *a[1], *a[2]);
  return {};
}

Value free_listener(void*, Arguments a) {
  world().free_listener(a[0]->to_int());
  return {};
}

Value listener_statistics(void*, Arguments a) {
  Value dictionary = Value::empty(kDictionary);
  const auto listener = world().listener(a[0]->to_int());
  clamor_listener_statistics statistics{};
  if (listener != nullptr) {
    const std::lock_guard lock(listener->telling);
    statistics = listener->statistics;
  }
  dictionary.set("voices", Integer(statistics.voices));
  dictionary.set("keyframes", Integer(statistics.keyframes));
  dictionary.set("keyframe_ms", statistics.keyframe_ms);
  dictionary.set("late_blocks", Integer(statistics.held_blocks));
  dictionary.set("memory_bytes", Integer(statistics.page_bytes + statistics.sound_bytes));
  dictionary.set("audio_load", listener == nullptr ? 0.0 : listener->load.load());
  return dictionary;
}

// Finds what is heard loudest, on the publisher's thread: vectors in the listener's frame whose
// lengths are amplitudes.
void find_loudest(Listener& listener, std::size_t most) {
  std::vector<clamor_voice> voices(20'000);
  auto given = sized<clamor_voices>();
  given.capacity = std::uint32_t(voices.size());
  given.voices = voices.data();
  if (clamor_get_voices(world().context(), listener.known, &given) != CLAMOR_OK) return;
  voices.resize(std::min<std::size_t>(given.count, voices.size()));
  const auto power = [](const clamor_voice& voice) {
    return std::inner_product(voice.band_gains, voice.band_gains + 8, voice.band_gains, 0.0f);
  };
  const std::size_t count = std::min(voices.size(), most);
  std::partial_sort(voices.begin(), voices.begin() + std::ptrdiff_t(count), voices.end(),
                    [&](const auto& x, const auto& y) { return power(x) > power(y); });
  std::vector<Vector3> loudest;
  for (std::size_t i = 0; i < count; ++i) {
    const float amplitude = std::sqrt(power(voices[i]) / 8);
    const auto& to = voices[i].direction;
    loudest.push_back({amplitude * to[0], amplitude * to[1], amplitude * to[2]});
  }
  const std::lock_guard lock(listener.telling);
  listener.loudest.swap(loudest);
}

// Returns as an array what was found since the last call, and has the publisher look again.
Value loudest_sources(void*, Arguments a) {
  const Value array = Value::empty(kArray);
  const auto listener = world().listener(a[0]->to_int());
  if (listener == nullptr || listener->known == 0) return array;
  const auto most = std::size_t(std::max(a[1]->to_int(), Integer{0}));
  world().publisher().run([listener, most] { find_loudest(*listener, most); });
  const std::lock_guard lock(listener->telling);
  for (const Vector3& one : listener->loudest) array.call("append", {one});
  return array;
}

// --- Sources
// --------------------------------------------------------------------------------------

Value play_source(void*, Arguments a) {
  return world().sources().play(a[0]->to_object(), *a[1], *a[2], a[3]->to_float());
}

Value change_source(void*, Arguments a) {
  world().sources().change(a[0]->to_int(), *a[1]);
  return {};
}

Value stop_source(void*, Arguments a) {
  world().sources().stop(a[0]->to_int());
  return {};
}

Value source_position(void*, Arguments a) { return world().sources().position_s(a[0]->to_int()); }

Value set_origin(void*, Arguments a) {
  world().sources().set_origin(a[0]->to_transform());
  return {};
}

Value is_offline(void*, Arguments) { return world().open() && world().is_offline(); }

// The arguments of methods that take the number of a level, listener, part or source alone.
std::vector<std::pair<const char*, Type>> number() { return {{"number", kInt}}; }

std::vector<Method> level_methods() {
  return {
      {"open_level",
       "Opens a bake in the background, and returns the level's number. Errors name [param node].",
       kInt,
       {{"file", kObject}, {"path", kString}, {"node", kString}},
       open_level},
      {"close_level", "Closes a level. Listeners in it hear it until they enter another one.", kNil,
       number(), close_level},
      {"get_level_state", "A level's [enum ClamorLevel3D.State], but 0 while it is being opened.",
       kInt, number(), level_state},
      {"get_level_info",
       "What [method ClamorLevel3D.get_info] returns; empty until the level is open.", kDictionary,
       number(), level_info},
      {"set_emitter",
       "Sets an emitter's gain, an amplitude of 0 to 1. Returns whether the level is open and has "
       "it.",
       kBool,
       {{"level", kInt}, {"name", kString}, {"gain", kFloat}, {"muted", kBool}},
       set_emitter},
      {"set_portal",
       "Sets how open a portal is, 0 to 1, or -1 where movable parts open it. Returns whether the "
       "level is open and has it.",
       kBool,
       {{"level", kInt}, {"name", kString}, {"openness", kFloat}},
       set_portal}};
}

std::vector<Method> part_methods() {
  return {
      {"find_part",
       "A number for a level's movable part, or 0 if there is none of this name.",
       kInt,
       {{"level", kInt}, {"name", kString}},
       find_part},
      {"add_part",
       "Adds a part that moves, of triangles, with [code]transmission[/code] and "
       "[code]absorption[/code], which are shares of energy, and the [code]node[/code] that errors "
       "name. Returns its number.",
       kInt,
       {{"faces", kPackedVector3Array},
        {"options", kDictionary},
        {"position", kVector3},
        {"rotation", kQuaternion}},
       add_part},
      {"move_part",
       "Moves a movable part, to a place in the level.",
       kNil,
       {{"part", kInt}, {"position", kVector3}, {"rotation", kQuaternion}},
       move_part},
      {"enable_part",
       "Whether a movable part hides and reflects anything.",
       kNil,
       {{"part", kInt}, {"enabled", kBool}},
       enable_part},
      {"remove_part",
       "Removes a part that [method add_part] has added. A level's part stays where it is.", kNil,
       number(), remove_part}};
}

std::vector<Method> listener_methods() {
  return {{"create_listener",
           "Creates a listener in a level, in the background, and returns its number. See the "
           "properties of [ClamorListener3D] for the options.",
           kInt,
           {{"level", kInt}, {"options", kDictionary}, {"node", kString}},
           create_listener},
          {"get_listener_stream", "The [AudioStream] of what a listener hears.", kAny, number(),
           listener_stream},
          {"get_listener_effect",
           "An [AudioEffect] for a bus of the listener's own, whose [code]layout[/code] has more "
           "than two channels.",
           kAny, number(), listener_effect},
          {"enter_level",
           "Crossfades a listener into another level.",
           kNil,
           {{"listener", kInt}, {"level", kInt}},
           enter_level},
          {"move_listener",
           "Moves a listener, to a place in its level.",
           kNil,
           {{"listener", kInt}, {"position", kVector3}, {"rotation", kQuaternion}},
           move_listener},
          {"free_listener", "Ends a listener, which fades out.", kNil, number(), free_listener},
          {"get_listener_statistics",
           "What [method ClamorListener3D.get_statistics] returns, and the number of "
           "[code]keyframes[/code] made.",
           kDictionary, number(), listener_statistics},
          {"get_loudest_sources",
           "Vectors to the loudest sources, in the frame of a listener's head, whose lengths are "
           "amplitudes, as they were found since the last call. The listener must have been "
           "created with [code]reports_voices[/code].",
           kArray,
           {{"listener", kInt}, {"count", kInt}},
           loudest_sources}};
}

std::vector<Method> source_methods() {
  return {
      {"play_source",
       "Plays a stream where a node is, from a position [s] on, and returns the source's number. "
       "See the properties of [ClamorSource3D] for the options. When it has ended, the node's "
       "[code]_on_ended()[/code] is called with the number.",
       kInt,
       {{"node", kObject},
        {"stream", kObject},
        {"options", kDictionary},
        {"from_position", kFloat}},
       play_source},
      {"change_source",
       "Changes the options of a source.",
       kNil,
       {{"source", kInt}, {"options", kDictionary}},
       change_source},
      {"stop_source", "Ends a source, which dies away.", kNil, number(), stop_source},
      {"get_source_position", "The position [s] in what a source plays.", kFloat, number(),
       source_position},
      {"set_origin",
       "Maps places of nodes to places in the level, for all sources.",
       kNil,
       {{"origin", kTransform}},
       set_origin},
      {"is_offline",
       "Whether keyframes are made for each block of sound, as in movies, instead of in real time.",
       kBool,
       {},
       is_offline}};
}

}  // namespace

void register_server() {
  std::vector<Method> methods;
  for (const auto& part :
       {level_methods(), part_methods(), listener_methods(), source_methods(), baker_methods()})
    methods.insert(methods.end(), part.begin(), part.end());
  // A server has no state of its own, but Godot takes no null for an instance.
  const auto create = []() -> void* { return new char; };
  const auto destroy = [](void* instance) { delete static_cast<char*>(instance); };
  register_class({"ClamorServer", "Object",
                  "What the add-on's nodes do, by numbers of levels, listeners, sources and parts.",
                  create, destroy, nullptr, methods});
}

}  // namespace clamor::godot
