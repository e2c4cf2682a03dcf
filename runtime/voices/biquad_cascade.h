// biquad_cascade.h: cascades of biquad filters in double precision, one cascade per vector lane.
//
// Transposed direct form 2, frame by frame, so the result does not depend on how calls divide time.
// Highway is visible only in biquad_cascade.cpp.
#pragma once

#include "common/bands.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

template <int kLanesOfIt, int kSectionsOfIt>
struct alignas(64) BiquadCascade {
  static constexpr int kLanes = kLanesOfIt, kSections = kSectionsOfIt;
  struct Section {
    double b0[kLanes], b1[kLanes], b2[kLanes], a1[kLanes], a2[kLanes];
  };
  struct Memory {
    double s1[kLanes], s2[kLanes];
  };
  Section section[kSections];
  Memory memory[kSections];
};

static_assert(kBandCount == 8, "sections of the longest path through the crossovers");
using HighCascade = BiquadCascade<8, 12>;  // 3 bands of 2 ears; 2 lanes unused
using LowCascade = BiquadCascade<16, 22>;  // 5 bands of 2 ears; 6 lanes unused

// Filters lanes[frames][kLanes] in place; 64-byte aligned.
void filter_lanes(HighCascade& cascade, double* lanes, int frames) noexcept REALTIME;
void filter_lanes(LowCascade& cascade, double* lanes, int frames) noexcept REALTIME;

}  // namespace clamor
