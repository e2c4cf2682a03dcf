// controls.h: controls that a script can find by their labels, curves over octave bands, and polar
// plots.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>

#include <imgui.h>

#include "common/bands.h"

namespace clamor {

// Where controls were drawn in this frame.
class ControlPlaces {
 public:
  void begin_frame() { centres_.clear(); }
  // Call after an item has been drawn.
  void add(const std::string& label);
  std::optional<ImVec2> centre_of(const std::string& label) const;

 private:
  std::map<std::string, ImVec2> centres_;
};
ControlPlaces& control_places();

// As ImGui::Button(); `width` 0 fits the label.
bool button(const char* label, float width = 0, bool is_on = false, bool is_enabled = true);

// A caption in dim text.
void caption(const char* text);

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
