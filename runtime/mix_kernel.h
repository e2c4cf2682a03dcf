// mix_kernel.h: the two inner loops of the mixer, for whatever vectors the CPU has.
//
// A bus is 16 lanes per frame, lane 2 x band + ear, so that a frame of one voice is one vector of
// gains times its (left, right) pair, repeated: one multiply-add with AVX-512, two with AVX2, four
// with SSE or NEON. Interpolated frames of a few voices are kept in L1 between reading and adding.
//
// Interpolation is Catmull-Rom's cubic. Its largest error over all fractions, relative to the tone:
// -107 dB at 500 Hz, -89 at 1 kHz, -71 at 2 kHz, -52 at 4 kHz, -32 at 8 kHz, -10 at 16 kHz. Its gain
// at the worst fraction (one half) is -0.01 dB at 4 kHz, -0.23 dB at 8 kHz, -3.3 dB at 16 kHz.
//
// Frames are added in the order of the voices, whatever the vector length; multiply-adds are fused
// where the CPU can, so CPUs differ in last bits and runs on one CPU do not. Highway is visible
// only in mix_kernel.cpp. Measured on one core of an EPYC with AVX-512, 48 kHz: see mixer.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/bands.h"
#include "runtime/realtime.h"

namespace clamor {

inline constexpr int kStepFrames = 64;  // what a kernel call mixes; divides kKeyframeFrames
inline constexpr int kEars = 2;
inline constexpr int kBusLanes = kEars * static_cast<int>(kBandCount);

constexpr int bus_lane(std::size_t band, int ear) { return kEars * static_cast<int>(band) + ear; }

// A voice during one step. Frame f of ear e reads the signal at `signal[e] + p`, p = f +
// fraction[e] + f x drift[e]; the samples from signal[e] - 2 to signal[e] + 2 kStepFrames + 8 must
// be there. Gains are those of frame 0 of the segment and how they grow per frame.
struct alignas(64) KernelVoice {
  float gain[kBusLanes];
  float slope[kBusLanes];
  const float* signal[kEars];
  float fraction[kEars];  // 0 to 1
  float drift[kEars];     // -1 to 1: how much faster than real time
};

// Adds `count` voices, voices[active[0]] first, to bus[kStepFrames][kBusLanes], of which the first
// frame is number `first_frame` of the segment. About 4 cycles per voice and frame with AVX-512.
void mix_voices(const KernelVoice* voices, const std::uint32_t* active, std::size_t count,
                int first_frame, float* bus) noexcept REALTIME;

// A cascade of biquads in each of the 16 lanes, transposed direct form 2, double precision.
inline constexpr int kBankSections = 20;
struct alignas(64) LaneCascade {
  struct Section {
    double b0[kBusLanes], b1[kBusLanes], b2[kBusLanes], a1[kBusLanes], a2[kBusLanes];
  };
  struct Memory {
    double s1[kBusLanes], s2[kBusLanes];
  };
  Section section[kBankSections];
  Memory memory[kBankSections];
};

// Filters lanes[frames][kBusLanes] in place.
void filter_lanes(LaneCascade& cascade, double* lanes, int frames) noexcept REALTIME;

// Name of the instruction set that is used, for benchmarks: "AVX3_ZEN4".
const char* mix_kernel_target();

}  // namespace clamor
