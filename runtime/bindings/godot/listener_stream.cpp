#include "runtime/bindings/godot/listener_stream.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "runtime/bindings/godot/world.h"

namespace clamor::godot {
namespace {

constexpr const char *kStream = "ClamorListenerStream", *kPlayback = "ClamorListenerPlayback",
                     *kEffect = "ClamorListenerEffect", *kInstance = "ClamorListenerEffectInstance";

struct Stream {
  std::shared_ptr<Listener> listener;
};
struct Playback {
  std::shared_ptr<Listener> listener;
  bool is_playing = false;
  std::uint64_t played_frames = 0;
};

struct Effect {
  std::shared_ptr<Listener> listener;
  int instances = 0;
};
struct EffectInstance {
  std::shared_ptr<Listener> listener;
  int pair = 0;
};

using Arguments = const void* const*;
using Virtual = void (*)(void* instance, Arguments arguments, void* result);

template <class T>
void write(void* result, T value) {
  *static_cast<T*>(result) = value;
}

void instantiate(void* instance, Arguments, void* result) {
  auto* playback = new Playback{static_cast<Stream*>(instance)->listener};
  engine.ref_set_object(result, make_object(kPlayback, "AudioStreamPlayback", playback));
}

void mix(void* instance, Arguments arguments, void* result) {
  auto& playback = *static_cast<Playback*>(instance);
  float* frames = *static_cast<float* const*>(arguments[0]);
  const auto count = *static_cast<const Integer*>(arguments[2]);
  if (playback.listener != nullptr)
    World::get().mix(*playback.listener, frames, int(count));
  else
    std::fill_n(frames, 2 * count, 0.0f);
  playback.played_frames += std::uint64_t(count);
  write(result, count);
}

// Godot makes the instances of all pairs in order, and again whenever a bus has changed.
void instantiate_effect(void* instance, Arguments, void* result) {
  auto& effect = *static_cast<Effect*>(instance);
  const int pairs = effect.listener == nullptr ? 1 : effect.listener->channels / 2;
  auto* made = new EffectInstance{effect.listener, effect.instances++ % pairs};
  engine.ref_set_object(result, make_object(kInstance, "AudioEffectInstance", made));
}

void process(void* instance, Arguments arguments, void*) {
  const auto& effect = *static_cast<EffectInstance*>(instance);
  float* frames = *static_cast<float* const*>(arguments[1]);
  const int count = int(*static_cast<const Integer*>(arguments[2]));
  if (effect.listener != nullptr)
    World::take_pair(*effect.listener, effect.pair, frames, count);
  else
    std::fill_n(frames, 2 * count, 0.0f);
}

void* find_in(const std::map<std::string, Virtual>& methods, const std::string& name) {
  const auto it = methods.find(name);
  return it == methods.end() ? nullptr : reinterpret_cast<void*>(it->second);
}

void* find_in_stream(const std::string& name) {
  static const std::map<std::string, Virtual> methods = {
      {"_instantiate_playback", instantiate},
      {"_get_length", [](void*, Arguments, void* result) { write(result, 0.0); }},
      {"_is_monophonic", [](void*, Arguments, void* result) { write(result, Boolean(1)); }}};
  return find_in(methods, name);
}

void* find_in_playback(const std::string& name) {
  static const auto set = [](void* instance, bool is_playing) {
    static_cast<Playback*>(instance)->is_playing = is_playing;
  };
  static const std::map<std::string, Virtual> methods = {
      {"_start", [](void* instance, Arguments, void*) { set(instance, true); }},
      {"_stop", [](void* instance, Arguments, void*) { set(instance, false); }},
      {"_is_playing",
       [](void* instance, Arguments, void* result) {
         write(result, Boolean(static_cast<Playback*>(instance)->is_playing));
       }},
      {"_get_loop_count", [](void*, Arguments, void* result) { write(result, Integer(0)); }},
      {"_get_playback_position",
       [](void* instance, Arguments, void* result) {
         write(result,
               double(static_cast<Playback*>(instance)->played_frames) / World::get().rate_hz());
       }},
      {"_seek", [](void*, Arguments, void*) {}},
      {"_mix", mix}};
  return find_in(methods, name);
}

void* find_in_effect(const std::string& name) {
  return name == "_instantiate" ? reinterpret_cast<void*>(Virtual{instantiate_effect}) : nullptr;
}

void* find_in_instance(const std::string& name) {
  return name == "_process" ? reinterpret_cast<void*>(Virtual{process}) : nullptr;
}

template <class T>
Class described(const char* name, const char* parent, const char* text,
                void* (*find)(const std::string&)) {
  return {name,
          parent,
          text,
          []() -> void* { return new T; },
          [](void* instance) { delete static_cast<T*>(instance); },
          find,
          {}};
}

}  // namespace

void register_listener_stream() {
  register_class(described<Playback>(kPlayback, "AudioStreamPlayback",
                                     "Mixes what a ClamorListener3D hears.", find_in_playback));
  register_class(described<Stream>(kStream, "AudioStream",
                                   "What a ClamorListener3D hears, which it plays itself.",
                                   find_in_stream));
  register_class(described<EffectInstance>(kInstance, "AudioEffectInstance",
                                           "Part of a ClamorListenerEffect.", find_in_instance));
  register_class(described<Effect>(
      kEffect, "AudioEffect",
      "Puts what a ClamorListener3D hears beyond stereo on a bus of its own.", find_in_effect));
}

Value make_listener_stream(std::shared_ptr<Listener> listener) {
  return Value(make_object(kStream, "AudioStream", new Stream{std::move(listener)}));
}

Value make_listener_effect(std::shared_ptr<Listener> listener) {
  return Value(make_object(kEffect, "AudioEffect", new Effect{std::move(listener)}));
}

}  // namespace clamor::godot
