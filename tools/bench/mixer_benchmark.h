// mixer_benchmark.h: how many voices one core mixes in real time, and where the time goes.
//
// Figures come from the thread's CPU time, which other programs disturb little; the median of
// several runs and the best of them are kept.
//
//   mixer      the whole Mixer: loading keyframes, placing and mixing voices, filtering bands
//   kernel     mix_voices() alone and the voices' advance from block to block
//   profile    mix_voices() on typical voices, on static ones, on static ones in L1, and on those
//              in shorter calls: the differences are the cost of sliding, memory and setup
//   reference  mix_reference(): frame by frame in double
//   openal     OpenAL Soft on as many voices at the same pitches, in alternation with Clamor: in
//              stereo with its defaults, and with its HRTF against Clamor's binaural mode. Static:
//              the kernel against OpenAL Soft's rendering alone. Moving: the mixer against OpenAL
//              Soft with its sources moved at every keyframe. Signals are in the caches; figures
//              are medians over the rounds.
//   field      taps of a field beside them (bench_field.h): renewal and convolution
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/voices/mix_kernel.h"
#include "tools/bench/bench_field.h"
#include "tools/bench/openal_voices.h"

namespace clamor {

struct VoicesInRealTime {
  double median = 0, best = 0;
};

// Operations of the kernel for one frame of a voice, counted as in mix_kernel.h: linear
// interpolation takes 1 multiply-add and 2 loads, cubic 5 and 4, once per delay and layer; each bus
// takes one more, and one for its gain ramp. Binaural, narrowband voices take those of the HRTF
// bands instead.
struct VoiceCost {
  double multiply_adds = 0, loads = 0;
  double reading = 0;  // multiply-adds of interpolation; the others are the buses'
};
VoiceCost cost_of(const MixMode& mode, std::uint32_t voices);

struct MixerTiming {
  enum class What : std::uint8_t { kMixer, kKernel, kReference };
  What what = What::kMixer;
  MixMode mode;
  std::string instructions;  // instruction set of the kernel
  std::uint32_t voices = 0;
  VoicesInRealTime real_time = {};
  VoiceCost work = {};
  // Shares of this core's peak with these instructions; for kernels only.
  double of_multiply_adds = 0, of_loads = 0;
};

// The mode of Clamor that is compared with OpenAL Soft: interpolation is linear if that of the
// library is, and cubic otherwise. Stereo has one delay and the full band, as OpenAL Soft has;
// binaural mixing has no such mode.
MixMode mode_like_openal(const std::string& resampler, OpenalOutput output);

struct OpenalTiming {
  OpenalOutput output = OpenalOutput::kStereo;
  std::uint32_t voices = 0;
  double still = 0, moving = 0;              // voices in real time
  double times_still = 0, times_moving = 0;  // Clamor's voices relative to OpenAL Soft's
};

// Breakdown of the time for one frame of a voice. The first two figures follow from the peak rate:
// reading_ns is the minimum for interpolation, ceiling_ns for all multiply-adds. The others are
// measured, and each includes the costs of the one before: static voices in L1 in calls of one step
// (in_steps_ns) and of a block, static voices, typical voices, and the whole mixer.
struct KernelProfile {
  MixMode mode;
  std::uint32_t voices = 0;
  double reading_ns = 0, ceiling_ns = 0;
  double in_steps_ns = 0, still_and_near_ns = 0, still_ns = 0, usual_ns = 0, mixer_ns = 0;

  // Setup of a voice, once per call, divided by the frames of a block.
  double taking_ns() const;
  double rest_ns() const { return still_and_near_ns - taking_ns() - ceiling_ns; }
  double memory_ns() const { return still_ns - still_and_near_ns; }
  double sliding_ns() const { return usual_ns - still_ns; }
  double keyframes_ns() const { return mixer_ns - usual_ns; }
};

struct MixerBenchmark {
  std::string instructions;  // the instruction set in use
  double peak_multiply_adds_per_s = 0, peak_loads_per_s = 0;
  std::vector<MixerTiming> figures;  // sorted as bench_modes(), then by voices
  // For the instruction set in use: first the mode that is compared with OpenAL Soft, at each
  // number of voices, then each mode.
  std::vector<KernelProfile> profiles;
  std::vector<FieldTiming> fields;  // sorted as field_modes(), then by taps
  OpenalLibrary openal;             // without a version if it is not installed
  std::string openal_head;          // the HRTF that it used; empty if it has none
  std::vector<OpenalTiming> against_openal;
};

struct BenchRequest {
  std::vector<std::uint32_t> voices;
  double seconds = 0.05;  // minimum CPU time of each run
  int runs = 5;
};

// Linear and cubic, with one delay or two, full band or eight bands; then the binaural modes.
const std::vector<MixMode>& bench_modes();

// Fails if nothing is heard. `progress` is called with the share that is done.
Result<MixerBenchmark> measure_mixer(const BenchRequest& request,
                                     const std::function<void(double)>& progress);

}  // namespace clamor
