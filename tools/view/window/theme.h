// theme.h: colours, spacing and fonts of the window.
#pragma once

#include <imgui.h>

namespace clamor {

// Four greys, one accent, and a colour for each part of the sound.
namespace theme {
inline constexpr ImU32 kText = IM_COL32(222, 224, 228, 255);
inline constexpr ImU32 kDimText = IM_COL32(150, 155, 163, 255);
inline constexpr ImU32 kPanel = IM_COL32(27, 29, 33, 255);
inline constexpr ImU32 kField = IM_COL32(40, 43, 49, 255);
inline constexpr ImU32 kLine = IM_COL32(58, 62, 70, 255);
inline constexpr ImU32 kAccent = IM_COL32(240, 158, 62, 255);
inline constexpr ImU32 kAccentDim = IM_COL32(122, 84, 44, 255);
inline constexpr ImU32 kGood = IM_COL32(92, 200, 180, 255);
inline constexpr ImU32 kBad = IM_COL32(232, 96, 86, 255);
}  // namespace theme

struct Fonts {
  ImFont* text = nullptr;
  ImFont* heading = nullptr;
  float text_px = 0, heading_px = 0;
};

// Sets style and fonts for a scale, 1 at 96 pixels an inch. A sans-serif font of the system is
// taken if there is one, or else ImGui's own.
Fonts apply_theme(float scale);

}  // namespace clamor
