#include "tools/view/window/panels.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/program/text_format.h"
#include "tools/report/level_findings.h"
#include "tools/view/window/controls.h"

namespace clamor {

namespace {

constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                                    ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                                    ImGuiWindowFlags_NoSavedSettings |
                                    ImGuiWindowFlags_NoBringToFrontOnFocus;

void begin_panel(const char* name, ImVec2 at, ImVec2 size, ImGuiWindowFlags flags = 0) {
  ImGui::SetNextWindowPos(at);
  ImGui::SetNextWindowSize(size);
  ImGui::Begin(name, nullptr, kFixed | flags);
}

// What the bakes in the background are doing, in a few words.
std::string bake_line(const ViewSession& session) {
  const ProgressiveBake::Status status = session.baking();
  const auto& newest = session.newest_bake();
  std::string line;
  if (newest && newest->error.empty())
    line = fmt::format("{} bake, {} sources{}", newest->stage, grouped(newest->sources),
                       newest->decay_error_db > 0
                           ? fmt::format(", decay known to {:.2f} dB", newest->decay_error_db)
                           : "");
  if (status.is_busy)
    line += fmt::format("{}baking{} {:.0f} %", line.empty() ? "" : "; ",
                        status.stage.empty() ? "" : " " + status.stage, 100 * status.share);
  return line;
}

}  // namespace

WindowLayout WindowLayout::of(float width, float height, float scale) {
  // A small window keeps half of its width and more of its height for the level.
  return {std::round(46 * scale),
          std::round(std::min(348 * scale, 0.5f * width)),
          std::round(std::min(164 * scale, 0.35f * height)),
          width,
          height,
          scale};
}

bool WindowLayout::place(const WalkCamera& camera, const Vec3& point_m, ImVec2& at) const {
  double x = 0, y = 0;
  if (!camera.project(point_m, aspect(), x, y)) return false;
  at = {static_cast<float>(x) * view_width(), toolbar + static_cast<float>(y) * view_height()};
  return true;
}

std::size_t Panels::gesture() {
  if (!was_dragging_) ++gestures_;
  was_dragging_ = true;
  return gestures_;
}

void Panels::draw(const WindowLayout& layout, const VoiceDisplay& voices) {
  scale_ = layout.scale;
  if (!ImGui::IsAnyItemActive()) was_dragging_ = false;
  draw_marks(layout);
  draw_message(layout);
  draw_toolbar(layout);
  draw_side(layout);
  draw_bottom(layout, voices);
  draw_questions();
}

void Panels::save() { tell(session_.save()); }

void Panels::ask_to_quit() {
  if (session_.is_editable() && !session_.level().is_saved())
    asks_to_quit_ = true;
  else
    quits_ = true;
}

void Panels::draw_toolbar(const WindowLayout& layout) {
  begin_panel("toolbar", {0, 0}, {layout.width, layout.toolbar}, ImGuiWindowFlags_NoScrollbar);
  ImGui::SetCursorPosY((layout.toolbar - ImGui::GetFrameHeight()) / 2);
  ImGui::AlignTextToFramePadding();
  const bool edits = session_.is_editable();
  const bool is_unsaved = edits && !session_.level().is_saved();
  ImGui::TextUnformatted((session_.title() + (is_unsaved ? " (unsaved)" : "")).c_str());
  ImGui::SameLine(0, 20 * scale_);
  const bool can_undo = edits && session_.level().history().can_undo();
  const bool can_redo = edits && session_.level().history().can_redo();
  if (button("Undo", 0, false, can_undo)) session_.undo();
  if (can_undo && ImGui::IsItemHovered())
    ImGui::SetTooltip("Undo: %s (Ctrl+Z)", session_.level().history().to_undo().c_str());
  ImGui::SameLine();
  if (button("Redo", 0, false, can_redo)) session_.redo();
  if (can_redo && ImGui::IsItemHovered())
    ImGui::SetTooltip("Redo: %s (Ctrl+Shift+Z)", session_.level().history().to_redo().c_str());
  ImGui::SameLine();
  if (button("Save", 0, false, is_unsaved)) save();
  if (edits && ImGui::IsItemHovered())
    ImGui::SetTooltip("Save to %s (Ctrl+S)", session_.level().sidecar_path().c_str());
  if (session_.has_other()) {
    ImGui::SameLine(0, 20 * scale_);
    if (button("A", 34 * scale_, !session_.plays_other())) session_.set_plays_other(false);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("Hear this level (Tab switches)");
    ImGui::SameLine(0, 2 * scale_);
    if (button("B", 34 * scale_, session_.plays_other())) session_.set_plays_other(true);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("Hear the bake of --compare (Tab switches)");
  }
  const std::string line = bake_line(session_);
  const float line_width = ImGui::CalcTextSize(line.c_str()).x;
  ImGui::SameLine(std::max(ImGui::GetCursorPosX(), layout.width - line_width - 14 * scale_));
  ImGui::AlignTextToFramePadding();
  caption(line);
  ImGui::End();
}

void Panels::draw_side(const WindowLayout& layout) {
  begin_panel("side", {layout.view_width(), layout.toolbar},
              {layout.side, layout.height - layout.toolbar});
  if (ImGui::BeginTabBar("tabs")) {
    const auto tab = [this](const char* label, const char* title, void (Panels::*draw)()) {
      if (!placed(label, ImGui::BeginTabItem(title))) return;
      (this->*draw)();
      ImGui::EndTabItem();
    };
    tab("Edit", "Edit", &Panels::draw_edit);
    tab("Listen", "Listen", &Panels::draw_listen);
    const auto& found = session_.findings();
    const auto wrong = std::ranges::count_if(found, is_warning);
    const std::string title =
        wrong == 0 ? "Findings###findings" : fmt::format("Findings ({})###findings", wrong);
    tab("Findings", title.c_str(), &Panels::draw_findings);
    ImGui::EndTabBar();
  }
  ImGui::End();
}

void Panels::draw_bottom(const WindowLayout& layout, const VoiceDisplay& voices) {
  begin_panel("bottom", {0, layout.height - layout.bottom}, {layout.view_width(), layout.bottom},
              ImGuiWindowFlags_NoScrollbar);
  const float height = ImGui::GetContentRegionAvail().y;
  draw_meters(150 * scale_, height);
  ImGui::SameLine(0, 20 * scale_);
  ImGui::BeginGroup();
  draw_figures(voices);
  ImGui::EndGroup();
  ImGui::SameLine(0, 20 * scale_);
  draw_spectrogram(std::max(80 * scale_, ImGui::GetContentRegionAvail().x), height);
  ImGui::End();
}

void Panels::draw_questions() {
  if (!asked_to_recover_) {
    asked_to_recover_ = true;
    if (session_.is_editable() && session_.level().has_unsaved_work())
      ImGui::OpenPopup("Unsaved work");
  }
  if (asks_to_quit_) {
    asks_to_quit_ = false;
    ImGui::OpenPopup("Leave?");
  }
  if (!problem_.empty() && !ImGui::IsPopupOpen("Problem")) ImGui::OpenPopup("Problem");
  const ImVec2 centre = ImGui::GetMainViewport()->GetCenter();
  const auto begin = [&](const char* name) {
    ImGui::SetNextWindowPos(centre, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSize({430 * scale_, 0});
    return ImGui::BeginPopupModal(
        name, nullptr,
        ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
  };
  // A button that also closes the question.
  const auto answer = [](const char* label) {
    const bool is_given = button(label);
    if (is_given) ImGui::CloseCurrentPopup();
    return is_given;
  };
  if (begin("Unsaved work")) {
    ImGui::TextWrapped("The last session ended without saving. Its changes to %s are still there.",
                       session_.title().c_str());
    if (answer("Recover")) tell(session_.recover());
    ImGui::SameLine();
    if (answer("Discard")) session_.level().discard_autosave();
    ImGui::EndPopup();
  }
  if (begin("Leave?")) {
    ImGui::TextWrapped("There are changes that are not saved.");
    if (answer("Save and leave")) {
      save();
      quits_ = problem_.empty();
    }
    ImGui::SameLine();
    if (answer("Discard and leave")) {
      session_.level().discard_autosave();
      quits_ = true;
    }
    ImGui::SameLine();
    answer("Stay");
    ImGui::EndPopup();
  }
  if (begin("Problem")) {
    ImGui::TextWrapped("%s", problem_.c_str());
    if (answer("Close")) problem_.clear();
    ImGui::EndPopup();
  }
}

}  // namespace clamor
