// voice_display.h: chosen sources as points that appear and fade as their voices do.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "runtime/engine/heard_source.h"

namespace clamor {

struct VoicePoint {
  Vec3f position_m{};
  SoundPart part = SoundPart::kDirect;
  float opacity = 0;       // 0 to 1: how far its voice has faded in
  float loudness = 0;      // 0 to 1: over the 50 dB below the loudest
  bool is_hidden = false;  // occluded by 15 dB or more
};

class VoiceDisplay {
 public:
  // Call in every frame with what is chosen now.
  void update(std::span<const HeardSource> heard, double seconds);

  const std::vector<VoicePoint>& points() const { return points_; }
  // Chosen now, and those of them that are hidden.
  std::size_t chosen() const { return chosen_; }
  std::size_t hidden() const { return hidden_; }

 private:
  struct Shown {
    VoicePoint point;
    bool is_chosen = false;
  };
  std::unordered_map<std::uint64_t, Shown> shown_;
  std::vector<VoicePoint> points_;
  std::size_t chosen_ = 0, hidden_ = 0;
};

}  // namespace clamor
