// listener_stream.h: what a listener hears, as an AudioStream that Godot's AudioStreamPlayer plays
// on a bus.
//
// Godot mixes the stream on its audio thread, in blocks of 512 frames as a rule, and Clamor renders
// into Godot's own block. Godot frees playbacks after it has ended extensions; so the classes are
// never unregistered, and the library stays in memory to the end.
#pragma once

#include <memory>

#include "runtime/bindings/godot/engine.h"

namespace clamor::godot {

struct Listener;

void register_listener_stream();

// A stream of a listener; silent once that is freed.
Value make_listener_stream(std::shared_ptr<Listener> listener);

}  // namespace clamor::godot
