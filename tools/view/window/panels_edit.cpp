// panels_edit.cpp: the panel that edits the surface, emitter or listener that is selected.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "common/reflection.h"
#include "formats/level/level_origin.h"
#include "formats/level/material_presets.h"
#include "tools/view/window/controls.h"
#include "tools/view/window/panels.h"

namespace clamor {

namespace {

using std::numbers::pi;

constexpr std::size_t kAngles = 180;
std::string band_label(std::size_t band) {
  const std::string name = kBandNames[band];
  return name.ends_with('k') ? name.substr(0, 1) + " kHz" : name + " Hz";
}
constexpr double kIncidence_rad = pi / 4;

double db_of(double gain) { return gain > 0 ? 20 * std::log10(gain) : -80; }

// What a surface reflects into each direction of the plane of incidence, relative to the incident
// power, on a scale of 30 dB. Angle 0 is along the surface, away from the incident sound.
std::vector<float> reflected(const Material& material, std::size_t band) {
  const ReflectionLaws laws(std::span(&material, 1));
  constexpr double kTop = 3, kRange_db = 30;  // per steradian
  std::vector<float> radius(kAngles + 1);
  for (std::size_t i = 0; i <= kAngles; ++i) {
    // The first half of a turn is above the surface.
    const double angle_rad = pi * static_cast<double>(i) / kAngles;
    const double departure_rad = pi / 2 - angle_rad;  // to the normal
    const double density =
        laws.density(0, band, std::cos(kIncidence_rad), std::max(std::cos(departure_rad), 1e-3),
                     std::cos(departure_rad - kIncidence_rad)) *
        static_cast<double>(1 - material.absorption[band]);
    const double db = 10 * std::log10(std::max(density, 1e-9) / kTop);
    radius[i] = static_cast<float>(std::clamp(1 + db / kRange_db, 0.0, 1.0));
  }
  // polar_plot() takes a full turn; the lower half stays in the centre.
  radius.resize(2 * kAngles, 0.0f);
  return radius;
}

std::vector<float> emitted(const Emitter& emitter, std::size_t band) {
  std::vector<float> radius(kAngles);
  for (std::size_t i = 0; i < kAngles; ++i) {
    const double angle_rad = 2 * pi * static_cast<double>(i) / kAngles;
    const double share = (1 + std::cos(angle_rad)) / 2;
    const double db =
        10 * static_cast<double>(emitter.directivity[band]) * std::log10(std::max(share, 1e-9));
    radius[i] = static_cast<float>(std::clamp(1 + db / 30, 0.0, 1.0));
  }
  return radius;
}

float polar_width(float scale) { return 220 * scale; }

// The band of a polar plot.
void band_buttons(std::size_t& band, float width) {
  ImGui::SetNextItemWidth(width);
  if (!ImGui::BeginCombo("##band", band_label(band).c_str())) return;
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (ImGui::Selectable(band_label(b).c_str(), b == band)) band = b;
  ImGui::EndCombo();
}

}  // namespace

bool Panels::draw_heading(const std::string& name) const {
  ImGui::PushFont(fonts_.heading);
  ImGui::TextUnformatted(name.c_str());
  ImGui::PopFont();
  ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize("All").x -
                  2 * ImGui::GetStyle().FramePadding.x);
  return button("All");
}

void Panels::draw_surface() {
  const std::size_t index = session_.selection().index;
  const bool edits = session_.is_editable();
  Material material = session_.materials()[index];
  if (draw_heading(material.name)) return session_.select({});

  if (edits) {
    const std::string& preset = session_.level().now().presets[index];
    caption("Preset");
    ImGui::SetNextItemWidth(-1);
    const char* const shown = preset.empty() ? "own values" : preset.c_str();
    if (placed("Preset", ImGui::BeginCombo("##preset", shown, ImGuiComboFlags_HeightLarge))) {
      caption("absorbs at 125 Hz and 1 kHz");
      for (const std::string& name : MaterialPresets::built_in().names()) {
        const bool chosen =
            placed("preset " + name, ImGui::Selectable(name.c_str(), name == preset));
        if (const auto values = MaterialPresets::built_in().get(name); values.ok()) {
          const std::string absorbs =
              fmt::format("{:.2f}  {:.2f}", values->absorption[1], values->absorption[4]);
          ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(absorbs.c_str()).x);
          caption(absorbs);
        }
        if (chosen) tell(session_.level().set_preset(index, name));
      }
      ImGui::EndCombo();
    }
    if (session_.materials()[index] != material) return;  // another preset
  }
  if (edits) draw_nodes();
  if (session_.selection().kind != Selection::Kind::kSurface) return;  // a movable part instead
  // Three curves and half of a circle fill the panel.
  const float line = ImGui::GetTextLineHeightWithSpacing();
  const float rest = ImGui::GetContentRegionAvail().y - 9.5f * line - (edits ? 0 : line) -
                     polar_width(scale_) * 0.56f;
  const float height = std::clamp(rest / 3, 40 * scale_, 110 * scale_);
  bool changed = band_curve("Absorption", material.absorption, CurveScale::kShare, height, edits);
  changed |= band_curve("Scattering", material.scattering, CurveScale::kShare, height, edits);
  changed |= band_curve("Exponent", material.phong, CurveScale::kExponent, height, edits);
  if (changed && edits) {
    for (std::size_t b = 0; b < kBandCount; ++b)
      material.transmission[b] = std::min(material.transmission[b], material.absorption[b]);
    session_.level().set_material(index, material, gesture());
  }
  caption("Reflected into each direction, 30 dB");
  const std::vector<float> radius = reflected(material, polar_band_);
  const PolarCurve whole{std::span(radius), theme::kAccent};
  const float top = ImGui::GetCursorPosY();
  polar_plot("Reflection", {&whole, 1}, polar_width(scale_), true,
             static_cast<float>(kIncidence_rad));
  ImGui::SameLine();
  ImGui::SetCursorPosY(top);
  band_buttons(polar_band_, 84 * scale_);
}

void Panels::draw_emitter() {
  const std::size_t index = session_.selection().index;
  Emitter emitter = session_.emitters()[index];
  if (draw_heading(emitter.name)) return session_.select({});
  const std::string why =
      session_.is_editable() ? session_.level().why_fixed(index) : std::string();
  const bool edits = session_.is_editable() && why.empty();
  if (!why.empty()) wrapped_caption(why);
  ImGui::BeginDisabled(!edits);
  bool changed = false, at_once = false;
  caption("Position, m");
  changed |= drag_place(emitter.position_m);
  const Listener here = session_.camera().listener();
  if (button("Move to me")) {
    emitter.position_m = here.position_m + 1.0 * here.forward();
    changed = at_once = true;
  }
  changed |= drag_direction(emitter.axis);
  const Vec3 to_me = here.position_m - emitter.position_m;
  const auto turn = [&](const char* label, const Vec3& axis) {
    if (!button(label) || !(length(axis) > 1e-6)) return;
    emitter.axis = normalize(axis);
    changed = at_once = true;
  };
  turn("Face me", to_me);
  ImGui::SameLine();
  turn("Face away", -to_me);
  ImGui::SameLine();
  turn("Turn round", Vec3(-emitter.axis.x, emitter.axis.y, -emitter.axis.z));
  caption("Gain, dB at 1 m");
  auto gain_db = static_cast<float>(db_of(emitter.gain));
  ImGui::SetNextItemWidth(-1);
  if (ImGui::SliderFloat("##gain", &gain_db, -60, 40, "%.1f dB")) {
    emitter.gain = std::pow(10.0, static_cast<double>(gain_db) / 20);
    changed = true;
  }
  changed |=
      band_curve("Directivity", emitter.directivity, CurveScale::kExponent, 74 * scale_, edits);
  for (float& exponent : emitter.directivity) exponent = std::min(exponent, 1000.0f);
  ImGui::EndDisabled();
  if (changed && edits) session_.level().set_emitter(index, emitter, at_once ? 0 : gesture());
  caption("Emitted into each direction, 30 dB");
  const std::vector<float> radius = emitted(emitter, polar_band_);
  const PolarCurve curve{std::span(radius), theme::kAccent};
  polar_plot("Emission", {&curve, 1}, 150 * scale_, false, 0);
  ImGui::SameLine();
  band_buttons(polar_band_, 84 * scale_);
  if (button("Remove emitter", 0, false, edits)) {
    session_.level().remove_emitter(index);
    session_.select({});
  }
}

bool Panels::drag_direction(Vec3& direction) const {
  caption("Direction, degrees: turn and tilt");
  auto yaw = static_cast<float>(std::atan2(-direction.x, -direction.z) * 180 / pi);
  auto pitch = static_cast<float>(std::asin(std::clamp(direction.y, -1.0, 1.0)) * 180 / pi);
  const float half = (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x) / 2;
  ImGui::SetNextItemWidth(half);
  bool turned = placed("Turn", ImGui::DragFloat("##yaw", &yaw, 1, -180, 180, "%.0f"));
  ImGui::SameLine();
  ImGui::SetNextItemWidth(half);
  turned |= ImGui::DragFloat("##pitch", &pitch, 1, -89, 89, "%.0f");
  if (!turned) return false;
  direction =
      Listener(Vec3(0), static_cast<double>(yaw) * pi / 180, static_cast<double>(pitch) * pi / 180)
          .forward();
  return true;
}

// Shows a place of the level in the world's coordinates, to be changed; true if it was.
bool Panels::drag_place(Vec3& place_m) const {
  const double least = -kMaxWorldCoordinate_m, most = kMaxWorldCoordinate_m;
  Vec3 in_world_m = place_m + session_.origin_m();
  ImGui::SetNextItemWidth(-1);
  if (!ImGui::DragScalarN("##at", ImGuiDataType_Double, &in_world_m.x, 3, 0.02f, &least, &most,
                          "%.2f"))
    return false;
  place_m = in_world_m - session_.origin_m();
  return true;
}

void Panels::draw_listener() {
  const std::size_t index = session_.selection().index;
  ListenerSpec listener = session_.listeners()[index];
  if (draw_heading(listener.name)) return session_.select({});
  if (button("Go there"))
    session_.camera().place(
        {listener.at_m, listener.yaw_deg * pi / 180, listener.pitch_deg * pi / 180});
  ImGui::SameLine();
  if (button("Move to me")) {
    listener.at_m = session_.camera().listener().position_m;
    listener.yaw_deg = session_.camera().yaw_rad() * 180 / pi;
    listener.pitch_deg = session_.camera().pitch_rad() * 180 / pi;
    session_.level().set_listener(index, listener);
  }
  caption("Position, m");
  if (drag_place(listener.at_m)) session_.level().set_listener(index, listener, gesture());
  if (button("Remove listener")) {
    session_.level().remove_listener(index);
    session_.select({});
  }
}

}  // namespace clamor
