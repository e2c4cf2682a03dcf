#include "tools/view/window/theme.h"

#include <cmath>
#include <filesystem>
#include <string>

namespace clamor {

namespace {

constexpr float kText_px = 15, kHeading_px = 18;

constexpr const char* kFontFiles[] = {
    "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf",
    "/usr/share/fonts/truetype/open-sans/OpenSans-Regular.ttf",
    "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
    "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf",
    "/usr/share/fonts/TTF/DejaVuSans.ttf",
    "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf",
    "/usr/share/fonts/truetype/freefont/FreeSans.ttf"};

std::string font_file() {
  for (const char* const file : kFontFiles) {
    std::error_code none;
    if (std::filesystem::exists(file, none)) return file;
  }
  return "";
}

}  // namespace

Fonts apply_theme(float scale) {
  ImGuiIO& io = ImGui::GetIO();
  io.Fonts->Clear();
  Fonts fonts;
  const std::string file = font_file();
  const auto load = [&](float size_px, float& px) {
    px = std::round(size_px * scale);
    if (!file.empty())
      if (ImFont* const font = io.Fonts->AddFontFromFileTTF(file.c_str(), px)) return font;
    ImFontConfig own;
    own.SizePixels = px = std::round(13 * scale);
    return io.Fonts->AddFontDefault(&own);
  };
  fonts.text = load(kText_px, fonts.text_px);
  fonts.heading = load(kHeading_px, fonts.heading_px);

  ImGuiStyle& style = ImGui::GetStyle();
  style = ImGuiStyle();
  ImGui::StyleColorsDark(&style);
  style.WindowPadding = {14, 12};
  style.FramePadding = {9, 5};
  style.ItemSpacing = {8, 8};
  style.ItemInnerSpacing = {6, 6};
  style.ScrollbarSize = 11;
  style.GrabMinSize = 12;
  style.FrameRounding = style.GrabRounding = style.TabRounding = 4;
  style.PopupRounding = 6;
  style.WindowRounding = 0;
  style.WindowBorderSize = 0;
  style.ScaleAllSizes(scale);
  const auto set = [&](ImGuiCol place, ImU32 colour) {
    style.Colors[place] = ImGui::ColorConvertU32ToFloat4(colour);
  };
  set(ImGuiCol_Text, theme::kText);
  set(ImGuiCol_TextDisabled, theme::kDimText);
  set(ImGuiCol_WindowBg, theme::kPanel);
  set(ImGuiCol_PopupBg, IM_COL32(34, 37, 42, 255));
  set(ImGuiCol_Border, theme::kLine);
  set(ImGuiCol_FrameBg, theme::kField);
  set(ImGuiCol_FrameBgHovered, IM_COL32(50, 54, 61, 255));
  set(ImGuiCol_FrameBgActive, IM_COL32(58, 62, 70, 255));
  set(ImGuiCol_Button, IM_COL32(48, 52, 59, 255));
  set(ImGuiCol_ButtonHovered, IM_COL32(64, 69, 78, 255));
  set(ImGuiCol_ButtonActive, theme::kAccentDim);
  set(ImGuiCol_Header, IM_COL32(52, 56, 64, 255));
  set(ImGuiCol_HeaderHovered, IM_COL32(60, 65, 74, 255));
  set(ImGuiCol_HeaderActive, theme::kAccentDim);
  set(ImGuiCol_SliderGrab, theme::kAccent);
  set(ImGuiCol_SliderGrabActive, theme::kAccent);
  set(ImGuiCol_CheckMark, theme::kAccent);
  set(ImGuiCol_Separator, theme::kLine);
  set(ImGuiCol_Tab, theme::kPanel);
  set(ImGuiCol_TabHovered, IM_COL32(60, 65, 74, 255));
  set(ImGuiCol_TabActive, IM_COL32(52, 56, 64, 255));
  set(ImGuiCol_TabUnfocused, theme::kPanel);
  set(ImGuiCol_TabUnfocusedActive, IM_COL32(52, 56, 64, 255));
  set(ImGuiCol_PlotHistogram, theme::kAccent);
  set(ImGuiCol_ModalWindowDimBg, IM_COL32(8, 9, 11, 150));
  set(ImGuiCol_ScrollbarBg, theme::kPanel);
  set(ImGuiCol_NavHighlight, theme::kAccent);
  return fonts;
}

}  // namespace clamor
