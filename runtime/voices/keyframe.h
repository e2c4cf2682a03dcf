// keyframe.h: how everything sounds at one moment: the voices, their delays and gains.
//
// Made by the sampler thread, mixed by the audio thread. Between two keyframes a voice's gains
// slide in straight lines, and its delays so that pitch does (mixer.h). A voice lives in a slot for
// as long as its source is heard; the sampler fades a voice to nothing before it leaves it out.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/bands.h"
#include "common/sample_rate.h"
#include "common/vec.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

inline constexpr int kKeyframeFrames = 960;  // 20 ms: 50 keyframes a second
inline constexpr double kKeyframe_s = static_cast<double>(kKeyframeFrames) / kSampleRate_hz;

struct Voice {
  std::uint32_t slot = 0;
  std::uint32_t signal = 0;
  bool starts = false;  // from silence at start_delay_frames; otherwise from the last keyframe
  // Where it starts: its gains hold from the last keyframe on, because its sound is only beginning.
  bool has_onset = false;
  std::array<double, kEars> start_delay_frames{};
  std::array<double, kEars> delay_frames{};
  std::array<Bands, kEars> gain{};  // amplitude
  // Where it is heard from, a unit vector: x ahead of the listener, y to the left, z up. For output
  // that is panned or binaural.
  Vec3f from{1, 0, 0};
  // Where there is no time for all: the highest rank goes first (load_control.h).
  std::uint8_t rank = 0;
};
inline constexpr std::uint8_t kHighestRank = 255;

// The listener's axes.
struct ListenerAxes {
  Vec3f ahead{1, 0, 0}, left{0, 1, 0}, up{0, 0, 1};
  bool is_known = false;
  bool operator==(const ListenerAxes&) const = default;
};

struct Keyframe {
  std::uint64_t number = 0;
  ListenerAxes facing;        // of the listener for whom it was made
  std::vector<Voice> voices;  // slots differ; capacity is set once
};

}  // namespace clamor
