#include "tools/view/voice_display.h"

#include <algorithm>
#include <cmath>

namespace clamor {

namespace {

constexpr double kFade_s = 0.1;  // as long as that of a voice
constexpr float kHidden = 0.03f;
constexpr double kRange_db = 50;

}  // namespace

void VoiceDisplay::update(std::span<const HeardSource> heard, double seconds) {
  for (auto& [number, shown] : shown_) shown.is_chosen = false;
  float loudest = 0;
  for (const HeardSource& source : heard) loudest = std::max(loudest, source.power);
  chosen_ = heard.size();
  hidden_ = 0;
  for (const HeardSource& source : heard) {
    Shown& shown = shown_[source.number];
    shown.is_chosen = true;
    shown.point.position_m = source.position_m;
    shown.point.part = source.part;
    shown.point.is_hidden = source.power_gain < kHidden;
    hidden_ += shown.point.is_hidden ? 1 : 0;
    const double below_db = source.power > 0
                                ? 10 * std::log10(static_cast<double>(source.power / loudest))
                                : -kRange_db;
    shown.point.loudness = static_cast<float>(std::clamp(1 + below_db / kRange_db, 0.0, 1.0));
  }
  const auto step = static_cast<float>(seconds / kFade_s);
  points_.clear();
  for (auto it = shown_.begin(); it != shown_.end();) {
    Shown& shown = it->second;
    shown.point.opacity =
        std::clamp(shown.point.opacity + (shown.is_chosen ? step : -step), 0.0f, 1.0f);
    if (!shown.is_chosen && shown.point.opacity <= 0) {
      it = shown_.erase(it);
      continue;
    }
    points_.push_back(shown.point);
    ++it;
  }
}

}  // namespace clamor
