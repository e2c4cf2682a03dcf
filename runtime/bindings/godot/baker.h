// baker.h: methods of ClamorServer that bake a level in the editor, on a thread of their own.
//
// They load libclamor_bake from the folder of this library at their first use, so that an exported
// game needs no such file.
#pragma once

#include <vector>

#include "runtime/bindings/godot/engine.h"

namespace clamor::godot {

std::vector<Method> baker_methods();

// Cancels a bake that is under way, and waits for it.
void end_baker();

}  // namespace clamor::godot
