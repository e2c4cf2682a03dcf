// keyboard.h: keys by GLFW's codes, in every version of Dear ImGui.
//
// Dear ImGui takes GLFW's codes themselves before 1.87 (Debian 12), and names of its own since
// then.
#pragma once

#include <span>

namespace clamor {

bool is_key_down(int key);
bool is_any_key_down();
// Whether the key went down in this frame, or repeats.
bool is_key_pressed(int key, bool repeats);

// Presses the keys that a script holds down, by code, and releases all others. Call it between the
// new frames of the backend and of Dear ImGui.
void set_keys(std::span<const bool> are_down);

// Keeps Dear ImGui from moving its focus by Tab; call in each frame.
void keep_tab();

}  // namespace clamor
