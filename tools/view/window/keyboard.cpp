#include "tools/view/window/keyboard.h"

#include <algorithm>

#include <GLFW/glfw3.h>
#include <imgui.h>
#include <imgui_internal.h>

namespace clamor {

#if IMGUI_VERSION_NUM < 18700

bool is_key_down(int key) { return ImGui::GetIO().KeysDown[key]; }

bool is_any_key_down() {
  return std::ranges::any_of(ImGui::GetIO().KeysDown, [](bool down) { return down; });
}

bool is_key_pressed(int key, bool repeats) { return ImGui::IsKeyPressed(key, repeats); }

void set_keys(std::span<const bool> are_down) {
  ImGuiIO& io = ImGui::GetIO();
  std::ranges::copy(are_down, io.KeysDown);
  io.KeyCtrl = are_down[GLFW_KEY_LEFT_CONTROL];
  io.KeyShift = are_down[GLFW_KEY_LEFT_SHIFT];
}

void keep_tab() { ImGui::GetIO().KeyMap[ImGuiKey_Tab] = -1; }

#else

namespace {

// Dear ImGui's name of a key that the window or its scripts use.
ImGuiKey name_of(int key) {
  if (key >= GLFW_KEY_A && key <= GLFW_KEY_Z)
    return static_cast<ImGuiKey>(ImGuiKey_A + (key - GLFW_KEY_A));
  if (key >= GLFW_KEY_0 && key <= GLFW_KEY_9)
    return static_cast<ImGuiKey>(ImGuiKey_0 + (key - GLFW_KEY_0));
  switch (key) {
    case GLFW_KEY_UP:
      return ImGuiKey_UpArrow;
    case GLFW_KEY_DOWN:
      return ImGuiKey_DownArrow;
    case GLFW_KEY_LEFT:
      return ImGuiKey_LeftArrow;
    case GLFW_KEY_RIGHT:
      return ImGuiKey_RightArrow;
    case GLFW_KEY_TAB:
      return ImGuiKey_Tab;
    case GLFW_KEY_ESCAPE:
      return ImGuiKey_Escape;
    case GLFW_KEY_ENTER:
      return ImGuiKey_Enter;
    case GLFW_KEY_LEFT_SHIFT:
      return ImGuiKey_LeftShift;
    case GLFW_KEY_LEFT_CONTROL:
      return ImGuiKey_LeftCtrl;
    default:
      return ImGuiKey_None;
  }
}

}  // namespace

bool is_key_down(int key) { return ImGui::IsKeyDown(name_of(key)); }

bool is_any_key_down() {
  for (int key = ImGuiKey_Tab; key < ImGuiKey_GamepadStart; ++key)
    if (ImGui::IsKeyDown(static_cast<ImGuiKey>(key))) return true;
  return false;
}

bool is_key_pressed(int key, bool repeats) { return ImGui::IsKeyPressed(name_of(key), repeats); }

void set_keys(std::span<const bool> are_down) {
  ImGuiIO& io = ImGui::GetIO();
  io.AddKeyEvent(ImGuiMod_Ctrl, are_down[GLFW_KEY_LEFT_CONTROL]);
  io.AddKeyEvent(ImGuiMod_Shift, are_down[GLFW_KEY_LEFT_SHIFT]);
  for (int key = 0; key < static_cast<int>(are_down.size()); ++key)
    if (const ImGuiKey name = name_of(key); name != ImGuiKey_None)
      io.AddKeyEvent(name, are_down[static_cast<std::size_t>(key)]);
}

void keep_tab() { ImGui::SetKeyOwner(ImGuiKey_Tab, ImHashStr("clamor"), ImGuiInputFlags_None); }

#endif

}  // namespace clamor
