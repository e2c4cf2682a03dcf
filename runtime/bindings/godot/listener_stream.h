// listener_stream.h: what a listener hears, as an AudioStream that Godot's AudioStreamPlayer plays
// on a bus.
//
// Godot mixes the stream on its audio thread, in blocks of 512 frames as a rule, and Clamor renders
// into Godot's own block. Streams have two channels. Where Godot plays to more, an effect on a bus
// of the listener's own puts the others there: Godot makes an instance of an effect for each pair
// of channels. Godot frees playbacks after it has ended extensions; so the classes are never
// unregistered, and the library stays in memory to the end.
#pragma once

#include <memory>

#include "runtime/bindings/godot/engine.h"

namespace clamor::godot {

struct Listener;

void register_listener_stream();

// A stream of a listener; silent once that is freed.
Value make_listener_stream(std::shared_ptr<Listener> listener);

// An AudioEffect that replaces what is on a bus by the listener's sound, for so many pairs of
// channels.
Value make_listener_effect(std::shared_ptr<Listener> listener);

}  // namespace clamor::godot
