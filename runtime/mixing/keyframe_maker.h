// keyframe_maker.h: from samples of sources to keyframes of voices.
//
// A source that is chosen gets a slot and keeps it while it is heard, so that its gains and delays
// slide. One that enters or leaves the sample fades over kFadeKeyframes (100 ms) with equal power:
// sin^2 + cos^2, for the one that takes its place. A source that stays but whose path jumps (the
// listener was moved, not walking) fades out where it was and in where it is now. A sound that
// begins does not fade in: where a source gets its slot before its signal's first sample arrives,
// its gains hold from the keyframe before on, and that sample is heard at its level.
//
// A loop that begins is played from its onset first: a signal of its own that plays the loop's
// first kOnset_frames once, so that nothing is heard before them (auralizer_input.h). Where both
// are the same samples, the voice changes over.
//
// What is hidden comes and goes in steps, as rays are cast; a voice's visibility glides there, half
// the way each keyframe. The factors that tell what a source stands for change with tau, as k does
// or as the listener walks: each change takes the course of a fade, over as many keyframes, so that
// the voices that come, go and stay have as much power together as the sampler says. (Half the way
// of the logarithm in each keyframe: 0.7 dB too much after k was halved, 1.0 where it was halved in
// each of four keyframes, 1.3 too little after it was doubled; now 0.00, 0.3 and 0.00.)
//
// A source that moves takes its voice along, so that its delays slide, and goes on as it went while
// it fades out; where it jumps it is heard as two. It is heard where it was when its sound left it.
//
// A voice whose source and ears are as they were keeps its numbers. Others are made a tile of slots
// at a time by vector code (voice_kernel.h), from what was worked out when they took their slots
// (voice_table.h): intensity becomes amplitude there and nowhere else.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/listener.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/mixing/itd_table.h"
#include "runtime/mixing/voice_kernel.h"
#include "runtime/mixing/voice_table.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/reception.h"
#include "runtime/sampling/sampler.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

inline constexpr double kEarDistance_m = 0.17;  // between the two receivers
inline constexpr int kFadeKeyframes = 5;

// By signal: the signal that its beginning is played from. That is the signal itself if it plays
// once. Loops that have always been playing have none.
using OnsetSignals = std::vector<std::uint32_t>;
inline constexpr std::uint32_t kNoOnset = 0xffffffff;

// A loop's onset equals the loop from kPartingTailFrames on until the filters meet its end; voices
// change over in between.
inline constexpr int kOnset_frames = 16384;
inline constexpr int kOnsetChange_frames = 4096;

class KeyframeMaker {
 public:
  // The listener's receivers: two, each at its own place and with its own directivity, or one at
  // the centre of the head, for output that is panned or filtered with an HRTF. With one receiver,
  // both ears of a voice are the same, except for the interaural delay of an HRTF.
  enum class Receivers : std::uint8_t { kPair, kOne };

  // `field` must outlive the maker. `slots` is how many voices may sound at once, fading ones
  // included; a source that finds none free waits until one is.
  KeyframeMaker(const RadiationModel& field, std::size_t slots,
                Receivers receivers = Receivers::kPair, std::shared_ptr<const Hrtf> head = nullptr,
                OnsetSignals onsets = {});

  // Fills in the next keyframe: the voices of `sample` for a listener with these receivers. The
  // first keyframe starts at full level. `keyframe.voices` must have room for all slots. The
  // keyframe begins `held_frames` later than its number says.
  void make(std::span<const SampledSource> sample, const Listener& listener, Keyframe& keyframe,
            const Reception& reception = Reception(), std::uint64_t held_frames = 0);

  // The time between a head's ears by direction; null without a head.
  const ItdTable* lags() const { return lags_.get(); }

 private:
  struct Slot {
    std::uint64_t number = 0;
    std::uint64_t chosen = 0;  // the last keyframe that it was chosen for
    float scale_goal = 1;      // of power
    // The goals of the keyframes before, the last one first.
    std::array<float, kFadeKeyframes - 1> scale_goals_before{};
    float rank = -1;
    std::int8_t fade = 0;  // of kFadeKeyframes; 0 is silence
    bool in_use = false;
    bool starts = false;   // with this keyframe
    bool frozen = false;   // its path jumped: fades out as it was
    bool changed = false;  // since it was made, though the ears may be where they were
    bool moves = false;
    bool glides = false;                 // to what is visible of it
    std::int8_t keyframes_to_weigh = 0;  // until its scale is its goal
    std::uint32_t loop = kNoOnset;       // what its voice changes over to, while it plays an onset

    void weigh_as(float goal) {
      if (goal != scale_goal) keyframes_to_weigh = kFadeKeyframes;
      scale_goal = goal;
    }
  };
  struct Heard {
    std::uint64_t number;
    std::uint32_t slot;
  };

  ListenerFrame head_at(const Listener& listener) const;
  void receive(std::span<const std::uint32_t> slots);
  void turn_to(const ListenerFrame& head);
  void join(std::span<const SampledSource> sample);
  std::uint32_t start(const SampledSource& chosen);
  void begin_sound(std::uint32_t s, const SampledSource& chosen);
  void leave_onset(std::uint32_t s);
  bool keep(std::uint32_t s, const SampledSource& chosen);
  bool follow(std::uint32_t s, const SampledSource& chosen);
  void coast(std::uint32_t s);
  void change(std::uint32_t s);
  void glide(std::uint32_t s);
  void weigh(std::uint32_t s);
  MovingSourcePoint point_of(const SampledSource& chosen) const;
  bool slides_to(std::uint32_t s, const MovingSourcePoint& point, double emission_frames) const;
  static std::uint8_t rank_by_level(const Voice& voice);
  std::uint8_t rank_of(const Slot& slot, const Voice& voice) const;
  bool is_chosen(const Slot& slot) const { return slot.chosen == made_; }
  std::size_t make_tile(std::size_t first, bool still, Keyframe& keyframe, std::size_t count);

  const Receivers receivers_;
  Reception reception_;
  const std::unique_ptr<const ItdTable> lags_;  // of a head
  const OnsetSignals onsets_;
  VoiceTable table_;
  std::array<std::vector<double>, kEars> last_frames_;  // the table's delays, where the head was
  std::vector<Slot> slots_;
  std::vector<Voice> voices_;           // by slot: as in the last keyframe, before fading
  std::vector<Bands> visibility_goal_;  // by slot
  std::vector<std::uint32_t> free_;     // slots, lowest last
  std::size_t used_ = 0;                // slots ever used: those from there on are free
  std::vector<Heard> heard_, joined_;   // by ascending number, some no longer in use
  std::vector<bool> tile_moved_;        // since it was placed
  ListenerFrame head_{}, last_head_{};
  Vec3 last_step_m_{0, 0, 0};
  double fastest_slide_frames_ = 0;  // of this keyframe
  std::size_t in_use_ = 0;
  std::uint64_t made_ = 0;
  double now_frames_ = 0;  // when the keyframe that is made comes
};

}  // namespace clamor
