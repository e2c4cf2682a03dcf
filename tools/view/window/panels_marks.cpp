// panels_marks.cpp: names and marks over the picture of the level, and the line below it.
#include <algorithm>

#include "tools/view/window/controls.h"
#include "tools/view/window/panels.h"

namespace clamor {

// Emitters, listeners and doors, with their names, over the level.
void Panels::draw_marks(const WindowLayout& layout) const {
  ImDrawList& draw = *ImGui::GetBackgroundDrawList();
  draw.PushClipRect({0, layout.toolbar},
                    {layout.view_width(), layout.toolbar + layout.view_height()});
  const WalkCamera& camera = session_.camera();
  const auto write = [&](const std::string& name, const ImVec2& at, float radius, ImU32 colour) {
    if (!name.empty()) draw_label(draw, {at.x + radius + 8 * scale_, at.y}, colour, name, scale_);
  };
  const auto mark = [&](const std::string& name, const Vec3& at_m, const Vec3& facing,
                        bool is_selected, bool is_emitter) {
    ImVec2 at, ahead;
    if (!layout.place(camera, at_m, at)) return;
    const ImU32 colour = is_selected ? theme::kAccent : theme::kText;
    const float radius = 7 * scale_;
    if (layout.place(camera, at_m + 0.6 * facing, ahead)) {
      draw.AddLine(at, ahead, colour, 2 * scale_);
      draw.AddCircleFilled(ahead, 3 * scale_, colour);
    }
    draw.AddCircleFilled(at, radius, theme::kPanel);
    draw.AddCircle(at, radius, colour, 0, 2 * scale_);
    if (is_emitter) draw.AddCircleFilled(at, radius * 0.4f, colour);
    write(name, at, radius, colour);
  };
  // Doors have a small square in their middle.
  const auto label = [&](const std::string& name, const Vec3& at_m, bool is_selected) {
    ImVec2 at;
    if (!layout.place(camera, at_m, at)) return;
    const ImU32 colour = is_selected ? theme::kAccent : theme::kText;
    const float half = 4 * scale_;
    draw.AddRectFilled({at.x - half, at.y - half}, {at.x + half, at.y + half}, colour);
    write(name, at, half, colour);
  };
  const Selection& chosen = session_.selection();
  const auto& emitters = session_.emitters();
  constexpr std::size_t kMostMarks = 200;  // a crowd would be a cloud of names
  for (std::size_t i = 0; i < std::min(emitters.size(), kMostMarks); ++i)
    mark(emitters[i].name, emitters[i].position_m, emitters[i].axis,
         chosen.kind == Selection::Kind::kEmitter && chosen.index == i, true);
  const auto& listeners = session_.listeners();
  for (std::size_t i = 0; i < listeners.size(); ++i) {
    constexpr double kDegree = 3.14159265358979323846 / 180;
    const Listener at(listeners[i].at_m, listeners[i].yaw_deg * kDegree,
                      listeners[i].pitch_deg * kDegree);
    mark(listeners[i].name, at.position_m, at.forward(),
         chosen.kind == Selection::Kind::kListener && chosen.index == i, false);
  }
  for (std::size_t p = 0; p < std::min(session_.parts().size(), kMostMarks); ++p)
    label(session_.parts()[p].name, session_.part_middle_m(p),
          chosen.kind == Selection::Kind::kPart && chosen.index == p);
  for (std::size_t p = 0; p < std::min(session_.portals().size(), kMostMarks); ++p)
    if (session_.parts_of(p).empty())
      label(session_.portals()[p].name, session_.portals()[p].centre_m,
            chosen.kind == Selection::Kind::kPortal && chosen.index == p);
  // The place of a finding that was chosen has a ring.
  const auto& place = session_.mark();
  if (ImVec2 at; place && layout.place(camera, place->place_m, at)) {
    const float radius = 14 * scale_;
    draw.AddCircle(at, radius + 2 * scale_, IM_COL32(20, 22, 25, 200), 0, 5 * scale_);
    draw.AddCircle(at, radius + 2 * scale_, theme::kBad, 0, 3 * scale_);
    draw.AddCircleFilled(at, 3 * scale_, theme::kBad);
    draw_label(draw, {at.x + radius + 10 * scale_, at.y}, theme::kBad, place->title, scale_);
  }
  draw.PopClipRect();
}

void Panels::draw_message(const WindowLayout& layout) const {
  ImDrawList& draw = *ImGui::GetBackgroundDrawList();
  const std::string& message = session_.message();
  const char* const help =
      "WASD walk, R and F up and down, right mouse button looks round, O opens a door";
  const std::string text = message.empty() ? help : message;
  const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, layout.view_width() * 0.8f);
  const ImVec2 at{14 * scale_, layout.toolbar + layout.view_height() - size.y - 14 * scale_};
  draw.AddRectFilled({at.x - 8 * scale_, at.y - 5 * scale_},
                     {at.x + size.x + 8 * scale_, at.y + size.y + 5 * scale_},
                     IM_COL32(20, 22, 25, 200), 4 * scale_);
  draw.AddText(fonts_.text, fonts_.text_px, at, theme::kText, text.c_str(), nullptr,
               layout.view_width() * 0.8f);
}

}  // namespace clamor
