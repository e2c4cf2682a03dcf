#include "tools/view/window/controls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "common/material.h"
#include "tools/view/window/theme.h"

namespace clamor {

namespace {

float height_of(float value, CurveScale scale) {
  if (scale == CurveScale::kShare) return std::clamp(value, 0.0f, 1.0f);
  return std::clamp(std::log10(1 + value) / std::log10(1 + kMirrorExponent), 0.0f, 1.0f);
}

// Above the exponents that a sidecar takes lies the mirror.
float value_at(float height, CurveScale scale) {
  if (scale == CurveScale::kShare) return std::round(height * 100) / 100;
  const float value = std::pow(1 + kMirrorExponent, height) - 1;
  if (value > kSharpestLobe) return height > 0.9f ? kMirrorExponent : kSharpestLobe;
  return value < 10 ? std::round(value * 10) / 10 : std::round(value);
}

std::string text_of(float value, CurveScale scale) {
  if (scale == CurveScale::kShare) return fmt::format("{:.2f}", value);
  return value >= kMirrorExponent ? "mirror" : fmt::format("{:.3g}", value);
}

}  // namespace

std::map<std::string, ImVec2>& control_places() {
  static std::map<std::string, ImVec2> places;
  return places;
}

bool placed(const std::string& label, bool result) {
  const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
  control_places()[label] = {(low.x + high.x) / 2, (low.y + high.y) / 2};
  return result;
}

bool button(const char* label, float width, bool is_on, bool is_enabled) {
  if (is_on) {
    ImGui::PushStyleColor(ImGuiCol_Button, theme::kAccent);
    ImGui::PushStyleColor(ImGuiCol_ButtonHovered, theme::kAccent);
    ImGui::PushStyleColor(ImGuiCol_Text, IM_COL32(24, 22, 18, 255));
  }
  ImGui::BeginDisabled(!is_enabled);
  const bool pressed = ImGui::Button(label, {width, 0});
  ImGui::EndDisabled();
  if (is_on) ImGui::PopStyleColor(3);
  const std::string text = label;
  return placed(text.substr(0, text.find("##")), pressed);
}

void caption(const std::string& text) {
  ImGui::PushStyleColor(ImGuiCol_Text, theme::kDimText);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopStyleColor();
}

void wrapped_caption(const std::string& text) {
  ImGui::PushTextWrapPos();
  caption(text);
  ImGui::PopTextWrapPos();
}

void draw_label(ImDrawList& draw, const ImVec2& at, ImU32 colour, const std::string& text,
                float scale) {
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  draw.AddRectFilled({at.x - 5 * scale, at.y - 2 * scale - size.y / 2},
                     {at.x + size.x + 5 * scale, at.y + size.y / 2 + 2 * scale},
                     IM_COL32(20, 22, 25, 170), 4 * scale);
  draw.AddText({at.x, at.y - size.y / 2}, colour, text.c_str());
}

bool band_curve(const char* label, Bands& values, CurveScale scale, float height, bool is_enabled) {
  const float line = ImGui::GetFontSize();
  const float width = ImGui::GetContentRegionAvail().x;
  caption(label);
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::InvisibleButton(label, {width, height + line + 4});
  placed(label);
  const bool is_active = ImGui::IsItemActive() && is_enabled, is_over = ImGui::IsItemHovered();
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const float column = width / static_cast<float>(kBandCount);
  const auto band = static_cast<std::size_t>(
      std::clamp((mouse.x - corner.x) / column, 0.0f, static_cast<float>(kBandCount) - 1));
  bool changed = false;
  if (is_active) {
    const float value = value_at(std::clamp(1 - (mouse.y - corner.y) / height, 0.0f, 1.0f), scale);
    // With Shift all bands follow.
    for (std::size_t b = 0; b < kBandCount; ++b)
      if ((b == band || ImGui::GetIO().KeyShift) && values[b] != value) {
        values[b] = value;
        changed = true;
      }
  }
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const ImVec2 end{corner.x + width, corner.y + height};
  draw.AddRectFilled(corner, end, theme::kField, 4);
  for (const float share : {0.25f, 0.5f, 0.75f}) {
    const float y = corner.y + height * (1 - share);
    draw.AddLine({corner.x, y}, {end.x, y}, theme::kLine);
  }
  std::array<ImVec2, kBandCount> points;
  for (std::size_t b = 0; b < kBandCount; ++b)
    points[b] = {corner.x + column * (static_cast<float>(b) + 0.5f),
                 corner.y + 4 + (height - 8) * (1 - height_of(values[b], scale))};
  const ImU32 colour = is_enabled ? theme::kAccent : theme::kDimText;
  draw.AddPolyline(points.data(), static_cast<int>(points.size()), colour, 0, 2);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const bool is_marked = (is_over || is_active) && b == band;
    draw.AddCircleFilled(points[b], is_marked ? 5.5f : 3.5f, colour);
    const ImVec2 size = ImGui::CalcTextSize(kBandNames[b]);
    draw.AddText({points[b].x - size.x / 2, end.y + 3}, is_marked ? theme::kText : theme::kDimText,
                 kBandNames[b]);
  }
  if (is_over || is_active) {
    const std::string text = text_of(values[band], scale);
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    draw.AddText({end.x - size.x, corner.y - size.y - 4}, theme::kText, text.c_str());
  }
  return changed;
}

void polar_plot(const char* label, std::span<const PolarCurve> curves, float size, bool has_floor,
                float incidence_rad) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float height = has_floor ? size * 0.56f : size;
  ImGui::Dummy({size, height});
  placed(label);
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const float reach = size / 2 - 6;
  const ImVec2 centre{corner.x + size / 2,
                      has_floor ? corner.y + height - 6 : corner.y + height / 2};
  const auto at = [&](float angle_rad, float radius) {
    return ImVec2{centre.x + reach * radius * std::cos(angle_rad),
                  centre.y - reach * radius * std::sin(angle_rad)};
  };
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  for (const float radius : {0.5f, 1.0f}) {
    if (has_floor) {
      draw.PathArcTo(centre, reach * radius, kTurn / 2, kTurn, 48);
      draw.PathStroke(theme::kLine, 0, 1);
    } else {
      draw.AddCircle(centre, reach * radius, theme::kLine, 64);
    }
  }
  draw.AddLine(at(kTurn / 2, 1), at(0, 1), theme::kLine);
  if (has_floor) {
    draw.AddLine(at(kTurn / 4 + incidence_rad, 1), centre, theme::kDimText, 1.5f);
    const ImVec2 tip = at(kTurn / 4 + incidence_rad, 0.12f);
    draw.AddTriangleFilled(centre, {tip.x - 4, tip.y - 1}, {tip.x + 1, tip.y - 5}, theme::kDimText);
  }
  for (const PolarCurve& curve : curves) {
    const auto count = static_cast<float>(curve.radius.size());
    for (std::size_t i = 0; i < curve.radius.size(); ++i)
      draw.PathLineTo(at(kTurn * static_cast<float>(i) / count, curve.radius[i]));
    draw.PathStroke(curve.colour, has_floor ? 0 : ImDrawFlags_Closed, 2);
  }
}

}  // namespace clamor
