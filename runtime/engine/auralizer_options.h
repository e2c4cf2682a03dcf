// auralizer_options.h: the options of an auralizer.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "runtime/mixing/load_control.h"
#include "runtime/mixing/output_format.h"
#include "runtime/occlusion/visibility_options.h"
#include "runtime/realtime/thread_hooks.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

class MovingScript;
class SamplingStrategy;

inline constexpr double kFirstSounds_s = 0.5, kFirstSoundsOfPlayer_s = 0.06;

// Samples of more voices than this serve one more keyframe for each, up to as many as a fade takes.
inline constexpr std::size_t kVoicesPerKeyframeOfSample = 5000;
inline constexpr std::size_t kMaxKeyframesPerSample = 5;

// How the sources of a sample are mixed: all as voices, or most of them as taps of a field
// (field_maker.h), which is cheaper for large samples and glides in steps.
enum class Mixing : std::uint8_t { kAuto, kField, kVoices };

struct AuralizerOptions {
  int voices = 2000;  // size of a sample
  Mixing mixing = Mixing::kVoices;
  bool has_dense_late = false;     // a field spreads late taps where they are few (late_density.h)
  std::size_t field_voices = 256;  // a field's loudest sources, which are mixed as voices
  // Null: priority sampling. Others are in tools/strategies.
  std::shared_ptr<const SamplingStrategy> strategy{};
  Interpolation interpolation = Interpolation::kCubic;  // see mix_kernel.h
  bool visibility = true;                               // surfaces occlude sources
  int rays = kRaysPerKeyframe;                          // per keyframe, for occlusion
  bool portable = false;                                // the same hits on all machines
  double gain = 1;                                      // amplitude of the whole output
  bool limit = false;                                   // true peaks to kLimiterCeiling_db
  OutputFormat output;
  int block_frames = 960;  // largest expected block; decides how far ahead keyframes are made
  // Memory for pages and sounds (memory_budget.h); 0: what the sounds need, up to a bound, and a
  // default for pages.
  std::uint64_t memory_bytes = 0;
  // Waits for pages and sounds, as a render does, and may then exceed the memory for one sample.
  bool wait_for_pages = false;
  // Time limit for keyframe 0 to wait for sounds, from creation on. Sources whose sound is loaded
  // later are chosen then.
  double first_sounds_s = kFirstSounds_s;
  // For a listener who moves in real time: keyframes are made as late as possible, and turn_head()
  // takes effect at once. The output then depends on when it is called.
  bool tracks_head = false;
  // The longest time between two calls of wants_keyframe() where it is above a millisecond, for
  // `tracks_head`.
  double sampler_period_s = 0;
  // Loads pages and sounds on threads of the auralizer's own. Otherwise the caller calls load().
  bool own_threads = true;
  ThreadHooks thread_hooks{};
  // Tells in a sentence that a page or a piece of a sound cannot be read, or a place is outside the
  // level. Called by the thread that loads or makes keyframes, several at a time.
  std::function<void(const char* sentence)> report{};
  // Load shedding: sample and mix fewer sources if time is short (load_control.h). For real time
  // only, since the output then depends on the machine. Each clock is read on its own thread, the
  // CPU meters on the sampler's.
  bool adapt = false;
  LoadClock sampler_clock = LoadClock::of_machine(), audio_clock = LoadClock::of_machine();
  MovingOptions moving{};
  // Movable parts may be added, besides those of the level (Auralizer::parts()). A free field then
  // costs as much as a level with surfaces.
  bool takes_parts = false;
  bool keeps_keyframe = false;  // for newest_keyframe()
  bool keeps_sample = false;    // for newest_sample()
  // Time on the clock of the emitters at which it begins: looping signals are then as far as if
  // they had been playing since time 0. Signals that play once begin with the auralizer.
  double begins_s = 0;
  bool mixes_voices = true;                // otherwise the output is silent, and costs nothing
  std::shared_ptr<MovingScript> script{};  // moves sources instead of the caller; sets `moving`
  // Once true, keyframes in progress end early. Must outlive the auralizer.
  const std::atomic<bool>* stop = nullptr;
};

}  // namespace clamor
