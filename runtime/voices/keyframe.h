// keyframe.h: the voices at one moment, with their delays and gains.
//
// The sampler thread makes keyframes, the audio thread mixes them. From one keyframe to the next
// gains change linearly, and delays so that pitch changes linearly (mixer.h). A voice keeps its
// slot while its source is audible; the sampler fades it out before it drops it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/bands.h"
#include "common/sample_rate.h"
#include "common/vec.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

inline constexpr int kKeyframeFrames = 960;  // 20 ms: 50 keyframes a second
inline constexpr double kKeyframe_s = static_cast<double>(kKeyframeFrames) / kSampleRate_hz;

// Number of keyframes that must be ready for blocks of this size: two more than the longest block
// has segments, that which is being mixed and that which may end within the block.
constexpr std::size_t keyframes_ahead(int block_frames) noexcept {
  return 2 + static_cast<std::size_t>((block_frames + kKeyframeFrames - 1) / kKeyframeFrames);
}

struct Voice {
  std::uint32_t slot = 0;
  std::uint32_t signal = 0;
  bool starts = false;  // from silence at start_delay_frames; otherwise from the last keyframe
  // The sound itself is beginning, so its gains hold from the last keyframe on
  // instead of fading in.
  bool has_onset = false;
  std::array<double, kEars> start_delay_frames{};
  std::array<double, kEars> delay_frames{};
  std::array<Bands, kEars> gain{};  // amplitude
  // Direction of arrival, a unit vector: x ahead of the listener, y to the left, z up. For panned
  // and binaural output.
  Vec3f from{1, 0, 0};
  // Voices with the highest rank are shed first when time is short (load_control.h).
  std::uint8_t rank = 0;
};
inline constexpr std::uint8_t kHighestRank = 255;

// The listener's axes in world space.
struct ListenerAxes {
  Vec3f ahead{1, 0, 0}, left{0, 1, 0}, up{0, 0, 1};
  bool is_known = false;
  bool operator==(const ListenerAxes&) const = default;
};

// Responses of sources that are no voices (field_response.h), which the mixer fades to from the
// keyframe's time on; null where nothing changes. The early part is renewed more often than the
// late one.
struct FieldResponse;
inline constexpr std::size_t kEarlyField = 0, kLateField = 1, kFieldParts = 2;
using FieldUpdate = std::array<FieldResponse*, kFieldParts>;

struct Keyframe {
  std::uint64_t number = 0;
  FieldUpdate field{};
  ListenerAxes facing;        // of the listener that it was made for
  std::vector<Voice> voices;  // one per slot at most; the capacity is set once
};

}  // namespace clamor
