// controls.h: controls that a script can find by their labels, curves over octave bands, and polar
// plots.
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>

#include <imgui.h>

#include "common/bands.h"

namespace clamor {

// The centres of the controls that were drawn in this frame, by their labels.
std::map<std::string, ImVec2>& control_places();

// Remembers the place of the item that was drawn last by its label, and returns `result`, as in
// placed("Strategy", ImGui::BeginCombo(...)).
bool placed(const std::string& label, bool result = false);

// As ImGui::Button(); `width` 0 fits the label.
bool button(const char* label, float width = 0, bool is_on = false, bool is_enabled = true);

// A caption in dim text, on one line or as many as it takes.
void caption(const std::string& text);
void wrapped_caption(const std::string& text);

// Text at a place of the picture, on a dark ground.
void draw_label(ImDrawList& draw, const ImVec2& at, ImU32 colour, const std::string& text,
                float scale);

inline constexpr std::array<const char*, kBandCount> kBandNames = {"63", "125", "250", "500",
                                                                   "1k", "2k",  "4k",  "8k"};

// Values over the eight bands that the mouse draws, from 0 to 1, or exponents from 0 to a mirror on
// a logarithmic scale. Returns whether one has changed.
enum class CurveScale { kShare, kExponent };
bool band_curve(const char* label, Bands& values, CurveScale scale, float height, bool is_enabled);

// A curve in polar coordinates: `radius` from 0 to 1 over the angle, 0 to the right and growing
// counter-clockwise. With a floor, angles below it are left out, and the incident ray is drawn.
struct PolarCurve {
  std::span<const float> radius;  // over a full turn
  ImU32 colour;
};
void polar_plot(const char* label, std::span<const PolarCurve> curves, float size, bool has_floor,
                float incidence_rad);

}  // namespace clamor
