// onset_signals.h: the signals that the beginnings of loops are played from (keyframe_maker.h).
#pragma once

#include <cstdint>
#include <vector>

namespace clamor {

// By signal: the signal that plays its beginning, or kNoOnset. A signal that plays once is its own
// onset; loops that have always been playing have none.
using OnsetSignals = std::vector<std::uint32_t>;
inline constexpr std::uint32_t kNoOnset = 0xffffffff;

// A loop's onset equals the loop from kPartingTailFrames until the filters reach the onset's end.
// Voices switch to the loop in between.
inline constexpr int kOnset_frames = 16384;
inline constexpr int kOnsetChange_frames = 4096;

}  // namespace clamor
