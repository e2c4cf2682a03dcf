// auralizer_options.h: what can be asked of an auralizer.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "runtime/mixing/load_control.h"
#include "runtime/mixing/output_format.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/sampling/moving_script.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/sampling/strategies.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

inline constexpr double kFirstSounds_s = 0.5, kFirstSoundsOfPlayer_s = 0.06;
inline constexpr std::uint64_t kMinSoundMemory_bytes =
    8'000'000;  // the longest that is not cut, and more

inline constexpr int kOutputChannels = 2;  // of the default output shape

// Of more voices, each choice of so many serves one keyframe more.
inline constexpr std::size_t kVoicesPerKeyframeOfSample = 5000;

struct AuralizerOptions {
  std::string strategy = "priority";                    // strategies.h lists them
  int voices = 2000;                                    // of the sample; "all" mixes every source
  Interpolation interpolation = Interpolation::kCubic;  // mix_kernel.h says what linear loses
  Estimator estimator = Estimator::kPower;
  StrategyTuning tuning{};
  bool visibility = true;       // do the level's surfaces hide sources
  int rays = kRaysPerKeyframe;  // that look for what they hide
  double gain = 1;              // amplitude, on the whole output
  bool limit = false;           // true peaks to kLimiterCeiling_db, after the gain
  OutputFormat output;
  int block_frames = 960;  // largest block of mix(): keyframes are made that far ahead
  // Of pages and sounds kept: sounds have up to half of it, pages the rest. With less than
  // 2 kMinSoundMemory_bytes, sounds may take that much all the same: without them pages are silent.
  std::uint64_t memory_bytes = 64'000'000;
  // For pages and sounds, as a render does, which then takes what memory one sample needs.
  bool wait_for_pages = false;
  // Counted from the creation: so long keyframe 0 may wait for sounds. Voices whose sound comes
  // later begin then.
  double first_sounds_s = kFirstSounds_s;
  // For a listener who is moved in real time: keyframes are made as late as the machine allows, one
  // ahead, and face() is heard at once. What is heard then depends on when it is called.
  bool tracks_head = false;
  // Choose and mix less where there is no time for all (load_control.h): for real time only, since
  // what is heard then depends on the machine. Each clock is read on its own thread.
  bool adapt = false;
  MovingOptions moving{};                  // for priority and all
  std::shared_ptr<MovingScript> script{};  // moves them instead of the caller; `moving` is its own
  LoadClock sampler_clock{}, audio_clock{};
  // Once it is true, keyframes that are being made end early with whatever they have found. It
  // must outlive the auralizer.
  const std::atomic<bool>* stop = nullptr;
};

}  // namespace clamor
