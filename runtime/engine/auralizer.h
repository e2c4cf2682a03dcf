// auralizer.h: makes a bake audible: samples its sources, makes keyframes and mixes them.
//
// The real-time player and the offline render use it in the same way:
//
//   sampler thread:  while (auralizer.wants_keyframe())
//                      auralizer.make_keyframe(listener at auralizer.next_keyframe_time_s());
//   audio thread:    auralizer.mix(block);
//
// Keyframe n describes the voices at sample n x kKeyframeFrames, unless one was late; the mixer
// interpolates between keyframes. They travel in order through a bounded queue, a few ahead of the
// mixer, so the output depends on the listener's movements only, not on thread scheduling or the
// device's block size. If the queue is empty, the mixer holds the last keyframe and counts that;
// later keyframes are then for later times, so that the sound does not fall behind the listener.
//
// For a listener who moves in real time (AuralizerOptions::tracks_head) latency is lower: keyframes
// are made just in time (keyframe_lead.h), and turn_head() passes rotations directly to the mixer.
//
// Large crowds are sampled less often, up to kMaxKeyframesPerSample keyframes apart, which is as
// long as a fade. Delays and gains of the sampled sources follow the listener in every keyframe.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/result.h"
#include "common/vec.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class BakeFile;
class MovingParts;
class MovingSources;
struct MixMode;
class ReplaceableSignals;
struct AuralizerInput;       // auralizer_input.h
struct AuralizerOptions;     // auralizer_options.h
struct AuralizerStatistics;  // auralizer_statistics.h
struct Keyframe;
struct Listener;
struct HeardSource;   // heard_source.h
struct PartHandle;    // moving_parts.h
struct SlotSignal;    // replaceable_signals.h
struct SoloSettings;  // solo_settings.h

inline constexpr int kOutputChannels = 2;  // of the default output format

class Auralizer {
 public:
  // Reads the file's first page; other pages and sounds are streamed, unless the strategy needs all
  // sources in memory. Errors: bad file, bad options, no sources.
  static Result<std::unique_ptr<Auralizer>> create(std::shared_ptr<const BakeFile> file,
                                                   const AuralizerOptions& options);
  // From sources in memory.
  static Result<std::unique_ptr<Auralizer>> create(AuralizerInput input,
                                                   const AuralizerOptions& options);
  ~Auralizer();

  // Sampler thread. Keyframe 0 waits for the sounds that it plays, but no longer than
  // first_sounds_s, and mixes 85 ms before time 0, so that sounds that have always been playing are
  // there from the first frame on. Until it is made, mix() gives silence. The time of the next
  // keyframe is constant between wants_keyframe() and make_keyframe().
  bool wants_keyframe() const;
  double next_keyframe_time_s() const;
  void make_keyframe(const Listener& at);

  // Reports the first listener and the first source, each once, at a place of the world that is
  // outside the level (level_extent.h). Needs AuralizerOptions::report, and surfaces that occlude.
  // Sampler thread; nanoseconds.
  enum class PlaceOf { kListener, kSource };
  void check_place(PlaceOf thing, const Vec3& place_m);

  // Before the first keyframe, for an auralizer that another one hands over to. warm_up() samples
  // what the first keyframes will, until all pages have arrived and new sources are tested for
  // occlusion, at most kMaxWarmUps times. Takes up to as long as so many keyframes, and for the
  // disk. skip() leaves out so many frames of the output, as if they had been mixed. Sampler
  // thread.
  void warm_up(const Listener& at);
  void skip(std::uint64_t frames);

  // Without threads of its own: loads the most urgent page or piece of a sound; false if nothing is
  // requested. Takes a millisecond or, where the disk is slow, longer. Sampler thread.
  bool load();

  // Rotates the listener's head at once, with `tracks_head`; positions come with keyframes. On any
  // one thread.
  void turn_head(const Listener& listener);

  // Sampler thread, or before there is one. Once `*stop` is true, a keyframe in progress ends early
  // with what has been sampled so far. `stop` must outlive the auralizer or be reset to null.
  void stop_when(const std::atomic<bool>* stop);

  int channels() const noexcept REALTIME;

  // Audio thread. Overwrites `interleaved`, any number of frames of all output channels. The cost
  // grows with voices x frames.
  void mix(std::span<float> interleaved) noexcept REALTIME;

  // On any one thread.
  AuralizerStatistics statistics();

  // Sources that the caller moves; null unless the options ask for any. Sampler thread.
  MovingSources* moving();

  // Movable parts, and the handles of the level's by their index in the bake. Null if the level has
  // none and the options take none, without occlusion, and if a script moves them. Sampler thread.
  MovingParts* parts();
  std::span<const PartHandle> level_parts() const;

  // Signals that the caller brings, in MovingOptions::signal_slots. Sampler thread.
  ReplaceableSignals& signal_slots();
  const ReplaceableSignals& signal_slots() const;
  // Sets a slot's signal, prepared for mode(). The slot must be free.
  void set_signal(std::size_t slot, SlotSignal signal);
  // Frees a slot, which no source may play, once its voices have faded out (replaceable_signals.h).
  // Removed sources that played it are heard no more.
  void clear_signal(std::size_t slot);
  // Sets what kind `kind` plays, after the kinds that the options name. No source may be of it.
  void set_kind(std::uint32_t kind, std::size_t slot, const Bands& directivity);
  const MixMode& mode() const;
  // Limits a group of moving sources to a share of the voices, 0 to 1.
  void limit_group(std::uint16_t group, double share);
  // Scales the power of the sources of each of the level's emitters, 0 to 1, by the emitter's
  // index; those beyond the end of the list keep theirs. Sampler thread.
  void set_emitter_powers(std::vector<float> powers);
  // Scales the power of everything that has passed a portal of the level, 0 to 1, by the portal's
  // index. Portals with kOpenedByParts (baked_portals.h) or beyond the end of the list are as open
  // as their movable parts leave them, or open without parts. Voices fade to it. Sampler thread;
  // costs microseconds for each thousand virtual emitters (baked_portals.h).
  void set_portals(std::vector<float> openness);

  // Scales bands, and direct, early and late sound, of all voices that are sampled from now on;
  // those that play fade to it. The choice of sources does not change. Sampler thread.
  void set_focus(const SoloSettings& focus);

  // The sources that the newest keyframe was made from, by ascending number; empty unless the
  // options keep them. Sampler thread.
  std::span<const HeardSource> newest_sample() const;

  // The newest keyframe; null before the first, and unless the options keep it. Sampler thread.
  const Keyframe* newest_keyframe() const;
  double newest_keyframe_time_s() const;

 private:
  struct State;
  static Result<void> check(const AuralizerOptions& options);
  explicit Auralizer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
