// mixer_benchmark.h: how many voices one core mixes in real time, and what stands in the way.
// Google Benchmark ends here.
//
// By CPU time of the thread, so that another program on the machine takes less of a figure than its
// own share; the median of several runs and the best of them are kept.
//
//   mixer      the whole of Mixer: keyframes loaded, voices placed and mixed, bands filtered
//   kernel     mix_voices() alone and the voices' advance from block to block
//   profile    mix_voices() on the same voices, then without those that slide, then with all they
//              read in L1 as well, then so in shorter calls: what of a frame's time each of these
//              costs beyond the multiply-adds
//   reference  mix_reference(): frame by frame in double
//   openal     OpenAL Soft (linear, one delay, stereo, no HRTF) on as many voices at the same
//              pitches, in turns with ours within one run. Still: the kernel against OpenAL Soft's
//              rendering alone; moving: the mixer against OpenAL Soft with its sources moved at
//              every keyframe. Each with its signals in the caches before; medians over the rounds.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

struct VoicesInRealTime {
  double median = 0, best = 0;
};

// What the kernel takes for one frame of a voice, as mix_kernel.h counts: a line is 1 multiply-add
// of 2 loads, a spline 5 of 4, each layer read once per delay; then one for each bus, and one for
// the bus's gain. Binaural, the loudest voices take those of a head's bands instead.
struct VoiceCost {
  double multiply_adds = 0, loads = 0;
  double reading = 0;  // of the multiply-adds; the others are the buses'
};
VoiceCost cost_of(const MixMode& mode, std::uint32_t voices);

struct MixerTiming {
  enum class What : std::uint8_t { kMixer, kKernel, kReference };
  What what = What::kMixer;
  MixMode mode;
  std::string instructions;  // of the kernel
  std::uint32_t voices = 0;  // mixed at once
  VoicesInRealTime real_time = {};
  VoiceCost work = {};
  // Of what this core can do at most with these instructions; of a kernel only.
  double of_multiply_adds = 0, of_loads = 0;
};

struct OpenalTiming {
  std::uint32_t voices = 0;
  double still = 0, moving = 0;              // voices in real time
  double times_still = 0, times_moving = 0;  // how many more are ours
};

// Where the time for a frame of a voice goes. Measured are the ceiling of what is read and of all,
// the kernel with voices that are still and in L1, in calls of one step and of a block, with those
// that are still, with all, and the mixer: each with what comes before it.
struct KernelProfile {
  MixMode mode;
  std::uint32_t voices = 0;
  double reading_ns = 0, ceiling_ns = 0;
  double in_steps_ns = 0, still_and_near_ns = 0, still_ns = 0, usual_ns = 0, mixer_ns = 0;

  // What a call does once for each voice, taking and handing it back, is a frame's share of a
  // block's; a call of one step has as much for fewer frames.
  double taking_ns() const;
  double rest_ns() const { return still_and_near_ns - taking_ns() - ceiling_ns; }
  double memory_ns() const { return still_ns - still_and_near_ns; }
  double sliding_ns() const { return usual_ns - still_ns; }
  double keyframes_ns() const { return mixer_ns - usual_ns; }
};

struct MixerBenchmark {
  std::string instructions;  // that are used where nothing else is said
  double peak_multiply_adds_per_s = 0, peak_loads_per_s = 0;
  std::vector<MixerTiming> figures;  // in the order of bench_modes(), then of voices
  // Of the instructions that are used: of each way of mixing, and before those of what is held
  // against OpenAL Soft at other numbers of voices.
  std::vector<KernelProfile> profiles;
  std::string openal;  // its version; empty: it is not there
  std::vector<OpenalTiming> against_openal;
};

struct BenchRequest {
  std::vector<std::uint32_t> voices;
  double seconds = 0.05;  // of CPU time at least, for each run of a figure
  int runs = 5;
};

// Linear and cubic, one delay or two, full band or eight bands; then binaural.
const std::vector<MixMode>& bench_modes();

// Fails in builds without Google Benchmark. `progress` is told the share that is done.
Result<MixerBenchmark> measure_mixer(const BenchRequest& request,
                                     const std::function<void(double)>& progress);

}  // namespace clamor
