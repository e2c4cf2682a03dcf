// panels_lists.cpp: the lists of what can be edited, while nothing is selected, and of what the
// bake found in the level.
#include <algorithm>
#include <numbers>

#include <fmt/format.h>

#include "tools/report/level_findings.h"
#include "tools/report/room_summary.h"
#include "tools/view/level_sounds.h"
#include "tools/view/window/controls.h"
#include "tools/view/window/panels.h"

namespace clamor {

void Panels::draw_edit() {
  if (!session_.is_editable()) wrapped_caption(session_.why_not_editable());
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
  wrapped_caption(
      "Click a surface, a door, an emitter or a listener in the level, or choose one here.");
  using Kind = Selection::Kind;
  ImGui::Spacing();
  ImGui::TextUnformatted("Emitters");
  const auto& emitters = session_.emitters();
  constexpr std::size_t kMostLines = 100;
  for (std::size_t i = 0; i < std::min(emitters.size(), kMostLines); ++i)
    if (ImGui::Selectable(fmt::format("{}##e{}", emitters[i].name, i).c_str()))
      return session_.select({Kind::kEmitter, i, 0});
  if (emitters.size() > kMostLines)
    caption(fmt::format("and {} more", emitters.size() - kMostLines));
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
    using std::numbers::pi;
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
    const bool chosen =
        placed("material " + materials[m].name,
               ImGui::Selectable(fmt::format("{}##m{}", materials[m].name, m).c_str()));
    const std::string area = fmt::format("{:.0f} m2", areas_m2_[m]);
    ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(area.c_str()).x);
    caption(area);
    if (!chosen) continue;
    const auto& of = session_.mesh().materials;
    const auto first = std::ranges::find(of, m);
    if (first != of.end())
      session_.select({Kind::kSurface, m, static_cast<std::uint32_t>(first - of.begin())});
    return;
  }
}

void Panels::add_emitter(const std::string& signal) { tell(session_.add_emitter(signal)); }

// Adds an emitter that plays a file: chosen from those beside the level, or typed.
void Panels::draw_sound_files() {
  wrapped_caption("Or a sound file in the level's folder; one can also be dropped on the window.");
  const float width = ImGui::CalcTextSize("Add sound").x + 2 * ImGui::GetStyle().FramePadding.x;
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - width - ImGui::GetFrameHeight() -
                          2 * ImGui::GetStyle().ItemSpacing.x);
  bool adds = ImGui::InputTextWithHint("##sound", "sounds/violin.flac", sound_path_.data(),
                                       sound_path_.size(), ImGuiInputTextFlags_EnterReturnsTrue);
  placed("Sound file");
  ImGui::SameLine();
  if (placed("Sounds",
             ImGui::BeginCombo("##sounds", "",
                               ImGuiComboFlags_NoPreview | ImGuiComboFlags_HeightLarge))) {
    if (ImGui::IsWindowAppearing()) sounds_ = sounds_beside(session_.level().path());
    if (sounds_.empty()) caption("There is none in the level's folder.");
    for (const std::string& sound : sounds_) {
      if (placed("sound " + sound, ImGui::Selectable(sound.c_str()))) {
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

void Panels::draw_findings() {
  ImGui::PushTextWrapPos();
  if (session_.findings().empty()) {
    caption(session_.sound().is_playing() ? "Nothing. Bakes of earlier versions keep only warnings."
                                          : "They come with the first bake.");
    ImGui::PopTextWrapPos();
    return;
  }
  caption(
      "What the bake found in the level, as bake, inspect and report say it. Click to see the "
      "place; Escape removes the mark.");
  if (!session_.cause_of_decay().empty()) {
    ImGui::Spacing();
    ImGui::PushStyleColor(ImGuiCol_Text, theme::kAccent);
    ImGui::TextUnformatted("What rings");
    ImGui::PopStyleColor();
    ImGui::TextUnformatted(session_.cause_of_decay().c_str());
  }
  int number = 0;
  for (const LevelFinding& finding : session_.findings()) {
    ImGui::PushID(number++);
    ImGui::Spacing();
    ImGui::PushStyleColor(ImGuiCol_Text, is_warning(finding) ? theme::kBad
                                         : finding.kind == LevelFinding::Kind::kFact
                                             ? theme::kGood
                                             : theme::kAccent);
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(title_of(finding.kind));
    ImGui::PopStyleColor();
    bool shows = false;
    if (finding.place_m) {
      ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize("Show").x -
                      2 * ImGui::GetStyle().FramePadding.x);
      shows = button("Show");
    }
    ImGui::TextUnformatted(finding.text.c_str());
    placed(fmt::format("{} {}", title_of(finding.kind), number));
    if (finding.place_m) {
      if (ImGui::IsItemHovered()) ImGui::SetMouseCursor(ImGuiMouseCursor_Hand);
      shows |= ImGui::IsItemClicked();
    }
    if (shows) session_.show(finding);
    ImGui::PopID();
  }
  ImGui::PopTextWrapPos();
}

}  // namespace clamor
