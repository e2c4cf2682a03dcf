// panels_findings.cpp: the panel that lists what the bake found in the level, and the mark of the
// place that was chosen there.
#include <fmt/format.h>

#include "tools/report/level_findings.h"
#include "tools/view/window/controls.h"
#include "tools/view/window/panels.h"

namespace clamor {

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
    control_places().add(fmt::format("{} {}", title_of(finding.kind), number));
    if (finding.place_m) {
      if (ImGui::IsItemHovered()) ImGui::SetMouseCursor(ImGuiMouseCursor_Hand);
      shows |= ImGui::IsItemClicked();
    }
    if (shows) session_.show(finding);
    ImGui::PopID();
  }
  ImGui::PopTextWrapPos();
}

void Panels::draw_place_mark(const WindowLayout& layout) const {
  const auto& mark = session_.mark();
  double x = 0, y = 0;
  const double aspect = static_cast<double>(layout.view_width() / layout.view_height());
  if (!mark || !session_.camera().project(mark->place_m, aspect, x, y)) return;
  ImDrawList& draw = *ImGui::GetBackgroundDrawList();
  const ImVec2 at{static_cast<float>(x) * layout.view_width(),
                  layout.toolbar + static_cast<float>(y) * layout.view_height()};
  const float radius = 14 * scale_;
  draw.AddCircle(at, radius + 2 * scale_, IM_COL32(20, 22, 25, 200), 0, 5 * scale_);
  draw.AddCircle(at, radius + 2 * scale_, theme::kBad, 0, 3 * scale_);
  draw.AddCircleFilled(at, 3 * scale_, theme::kBad);
  const ImVec2 size = ImGui::CalcTextSize(mark->title.c_str());
  const ImVec2 text{at.x + radius + 10 * scale_, at.y - size.y / 2};
  draw.AddRectFilled({text.x - 5 * scale_, text.y - 2 * scale_},
                     {text.x + size.x + 5 * scale_, text.y + size.y + 2 * scale_},
                     IM_COL32(20, 22, 25, 170), 4 * scale_);
  draw.AddText(text, theme::kBad, mark->title.c_str());
}

}  // namespace clamor
