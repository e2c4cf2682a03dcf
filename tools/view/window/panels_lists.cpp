// panels_lists.cpp: the lists of what can be edited, while nothing is selected.
#include <algorithm>
#include <numbers>

#include <fmt/format.h>

#include "tools/report/room_summary.h"
#include "tools/view/level_sounds.h"
#include "tools/view/window/controls.h"
#include "tools/view/window/panels.h"

namespace clamor {

namespace {

using std::numbers::pi;

}  // namespace

void Panels::draw_edit() {
  if (!session_.is_editable()) {
    ImGui::PushTextWrapPos();
    caption(session_.why_not_editable().c_str());
    ImGui::PopTextWrapPos();
  }
  switch (session_.selection().kind) {
    case Selection::Kind::kSurface:
      return draw_surface();
    case Selection::Kind::kEmitter:
      return draw_emitter();
    case Selection::Kind::kListener:
      return draw_listener();
    case Selection::Kind::kPart:
      return draw_part();
    case Selection::Kind::kPortal:
      return draw_portal();
    case Selection::Kind::kNone:
      return draw_lists();
  }
}

void Panels::draw_lists() {
  ImGui::PushTextWrapPos();
  caption("Click a surface, a door, an emitter or a listener in the level, or choose one here.");
  ImGui::PopTextWrapPos();
  using Kind = Selection::Kind;
  ImGui::Spacing();
  ImGui::TextUnformatted("Emitters");
  const auto& emitters = session_.emitters();
  constexpr std::size_t kMostLines = 100;
  for (std::size_t i = 0; i < std::min(emitters.size(), kMostLines); ++i)
    if (ImGui::Selectable(fmt::format("{}##e{}", emitters[i].name, i).c_str()))
      return session_.select({Kind::kEmitter, i, 0});
  if (emitters.size() > kMostLines)
    caption(fmt::format("and {} more", emitters.size() - kMostLines).c_str());
  if (session_.is_editable()) {
    if (button("Add noise")) add_emitter("noise");
    ImGui::SameLine();
    if (button("Add impulse")) add_emitter("impulse");
    draw_sound_files();
  }
  if (draw_doors()) return;
  ImGui::Spacing();
  ImGui::TextUnformatted("Listeners");
  const auto& listeners = session_.listeners();
  for (std::size_t i = 0; i < listeners.size(); ++i)
    if (ImGui::Selectable(fmt::format("{}##l{}", listeners[i].name, i).c_str()))
      return session_.select({Kind::kListener, i, 0});
  if (session_.is_editable() && button("Add listener here")) {
    ListenerSpec spec;
    spec.name = fmt::format("listener {}", listeners.size() + 1);
    spec.at_m = session_.camera().listener().position_m;
    spec.yaw_deg = session_.camera().yaw_rad() * 180 / pi;
    spec.pitch_deg = session_.camera().pitch_rad() * 180 / pi;
    session_.level().add_listener(spec);
  }
  ImGui::Spacing();
  ImGui::TextUnformatted("Materials");
  const auto& materials = session_.materials();
  if (area_revision_ != session_.shape_revision() || areas_m2_.size() != materials.size()) {
    area_revision_ = session_.shape_revision();
    areas_m2_ = areas_m2(session_.mesh(), materials.size());
  }
  for (std::size_t m = 0; m < materials.size(); ++m) {
    if (!(areas_m2_[m] > 0)) continue;  // nothing of it can be seen
    const bool chosen = ImGui::Selectable(fmt::format("{}##m{}", materials[m].name, m).c_str());
    control_places().add("material " + materials[m].name);
    const std::string area = fmt::format("{:.0f} m2", areas_m2_[m]);
    ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(area.c_str()).x);
    caption(area.c_str());
    if (!chosen) continue;
    const auto& of = session_.mesh().materials;
    const auto first = std::ranges::find(of, m);
    if (first != of.end())
      session_.select({Kind::kSurface, m, static_cast<std::uint32_t>(first - of.begin())});
    return;
  }
}

void Panels::add_emitter(const std::string& signal) {
  if (auto added = session_.add_emitter(signal); !added.ok()) problem_ = added.error().message;
}

// Adds an emitter that plays a file: chosen from those beside the level, or typed.
void Panels::draw_sound_files() {
  ImGui::PushTextWrapPos();
  caption("Or a sound file in the level's folder; one can also be dropped on the window.");
  ImGui::PopTextWrapPos();
  const float width = ImGui::CalcTextSize("Add sound").x + 2 * ImGui::GetStyle().FramePadding.x;
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - width - ImGui::GetFrameHeight() -
                          2 * ImGui::GetStyle().ItemSpacing.x);
  bool adds = ImGui::InputTextWithHint("##sound", "sounds/violin.flac", sound_path_.data(),
                                       sound_path_.size(), ImGuiInputTextFlags_EnterReturnsTrue);
  control_places().add("Sound file");
  ImGui::SameLine();
  const bool is_open =
      ImGui::BeginCombo("##sounds", "", ImGuiComboFlags_NoPreview | ImGuiComboFlags_HeightLarge);
  control_places().add("Sounds");
  if (is_open) {
    if (ImGui::IsWindowAppearing()) sounds_ = sounds_beside(session_.level().path());
    if (sounds_.empty()) caption("There is none in the level's folder.");
    for (const std::string& sound : sounds_) {
      const bool chosen = ImGui::Selectable(sound.c_str());
      control_places().add("sound " + sound);
      if (chosen) {
        sound_path_.fill(0);
        sound.copy(sound_path_.data(), sound_path_.size() - 1);
        adds = true;
      }
    }
    ImGui::EndCombo();
  }
  ImGui::SameLine();
  adds |= button("Add sound", 0, false, sound_path_[0] != 0);
  if (adds) add_emitter(sound_path_.data());
}

}  // namespace clamor
