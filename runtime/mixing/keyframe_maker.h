// keyframe_maker.h: turns samples of sources into keyframes of voices.
//
// A chosen source gets a slot and keeps it while it is audible, so that gains and delays change
// smoothly. A source that enters or leaves the sample crossfades over kFadeKeyframes (100 ms) with
// equal power, sin^2 + cos^2. A source that stays but whose path jumps (the listener was moved, not
// walking) fades out at its old position and in at its new one. A sound that begins does not fade
// in: if a source gets its slot before the first sample of its signal arrives, its gains hold from
// the keyframe before on, so that the sample has its full level.
//
// A loop that begins is first played from its onset: a separate signal that plays the loop's first
// kOnset_frames once, after silence (auralizer_input.h). The voice switches to the loop where both
// have the same samples.
//
// Occlusion changes in steps, as rays are cast, so a voice's visibility moves half of the way to
// its target at each keyframe. A source's power scale changes with tau, as k changes or the
// listener walks. Each change follows the curve of a fade over as many keyframes, so that voices
// that enter, leave and stay keep the total power that the sampler intends. (Exponential smoothing
// instead was 0.7 dB too loud after k was halved, 1.0 dB when it was halved in each of four
// keyframes, and 1.3 dB too quiet after it was doubled; now the errors are 0.00, 0.3 and 0.00.)
//
// A moving source takes its voice along, so that its delays change smoothly, and moves on while it
// fades out; if it jumps, it is heard as two. A moving source is heard at the position where the
// sound left it.
//
// A voice whose source and listener have not moved keeps its values. All others are computed a tile
// of slots at a time by vector code (voice_kernel.h) from data prepared when they took their slots
// (voice_table.h). Intensity becomes amplitude there and nowhere else.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/listener.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/mixing/itd_table.h"
#include "runtime/mixing/onset_signals.h"
#include "runtime/mixing/voice_kernel.h"
#include "runtime/mixing/voice_table.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/reception.h"
#include "runtime/sampling/sampler.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

inline constexpr double kEarDistance_m = 0.17;  // between the two receivers
inline constexpr int kFadeKeyframes = 5;

class KeyframeMaker {
 public:
  // The listener's receivers: two with their own positions and directivity, or one in the centre
  // for panned and binaural output. With one, both ears of a voice are equal, except for the ITD of
  // an HRTF.
  enum class Receivers : std::uint8_t { kPair, kOne };

  // `field` must outlive this. `slots` is how many voices may sound at once, including those that
  // fade out; a source waits if none is free.
  KeyframeMaker(const RadiationModel& field, std::size_t slots,
                Receivers receivers = Receivers::kPair, std::shared_ptr<const Hrtf> head = nullptr,
                OnsetSignals onsets = {});

  // Fills in the next keyframe: `sample` as a listener with these receivers hears it. The first
  // keyframe starts at full level. `keyframe.voices` must have capacity for all slots. The keyframe
  // is due `held_frames` later than its number says.
  void make(std::span<const SampledSource> sample, const Listener& listener, Keyframe& keyframe,
            const Reception& reception = Reception(), std::uint64_t held_frames = 0);

  // ITDs of the HRTF, or null.
  const ItdTable* lags() const { return lags_.get(); }

 private:
  // Bound on the change of a delay per keyframe: a delay cannot shrink faster than time passes. A
  // source that approaches at half the speed of sound (kMaxSourceMach) stays below it.
  static constexpr double kFastestSlide_frames = 0.98 * kKeyframeFrames;

  struct Slot {
    std::uint64_t number = 0;
    std::uint64_t chosen = 0;  // the last keyframe that it was chosen for
    float scale_goal = 1;      // of power
    // Targets of the previous keyframes, the newest first.
    std::array<float, kFadeKeyframes - 1> scale_goals_before{};
    float rank = -1;
    std::int8_t fade = 0;  // of kFadeKeyframes; 0 is silence
    bool in_use = false;
    bool starts = false;   // with this keyframe
    bool frozen = false;   // its path jumped: fades out as it was
    bool changed = false;  // must be recomputed even if the listener stays
    bool moves = false;
    bool smooths = false;                     // visibility is moving to its target
    std::int8_t keyframes_to_scale_goal = 0;  // until the scale is at its target
    std::uint32_t loop = kNoOnset;  // the loop that follows while the voice plays an onset

    void set_scale(float goal) {
      if (goal != scale_goal) keyframes_to_scale_goal = kFadeKeyframes;
      scale_goal = goal;
    }
  };
  struct SlotOfSource {
    std::uint64_t number;
    std::uint32_t slot;
  };

  ListenerFrame listener_frame(const Listener& listener) const;
  void apply_directivity(std::span<const std::uint32_t> slots);
  void place_all(const ListenerFrame& head);
  void assign_slots(std::span<const SampledSource> sample);
  std::uint32_t start(const SampledSource& chosen);
  void begin_sound(std::uint32_t s, const SampledSource& chosen);
  void switch_to_loop(std::uint32_t s);
  bool keep(std::uint32_t s, const SampledSource& chosen);
  bool follow(std::uint32_t s, const SampledSource& chosen);
  void extrapolate(std::uint32_t s);
  void mark_changed(std::uint32_t s);
  void smooth_visibility(std::uint32_t s);
  void update_scale(std::uint32_t s);
  MovingSourcePoint point_of(const SampledSource& chosen) const;
  bool slides_to(std::uint32_t s, const MovingSourcePoint& point, double emission_frames) const;
  static std::uint8_t rank_by_level(const Voice& voice);
  std::uint8_t rank_of(const Slot& slot, const Voice& voice) const;
  bool is_chosen(const Slot& slot) const { return slot.chosen == made_; }
  std::size_t make_tile(std::size_t first, bool still, Keyframe& keyframe, std::size_t count);

  const Receivers receivers_;
  Reception reception_;
  const std::unique_ptr<const ItdTable> lags_;  // null without an HRTF
  const OnsetSignals onsets_;
  VoiceTable table_;
  std::array<std::vector<double>, kEars> last_frames_;  // the table's delays in the last keyframe
  std::vector<Slot> slots_;
  std::vector<Voice> voices_;           // by slot: as in the last keyframe, before fading
  std::vector<Bands> visibility_goal_;  // by slot
  std::vector<std::uint32_t> free_;     // slots, the lowest last
  std::size_t used_ = 0;                // slots ever used; all others are free
  std::vector<SlotOfSource> slots_by_number_,
      next_by_number_;            // sorted by number; some no longer in use
  std::vector<bool> tile_moved_;  // since its voices were placed
  ListenerFrame head_{}, last_head_{};
  Vec3 last_step_m_{0, 0, 0};
  double fastest_slide_frames_ = 0;  // for this keyframe
  std::size_t in_use_ = 0;
  std::uint64_t made_ = 0;
  double now_frames_ = 0;  // due time of the keyframe being made
};

}  // namespace clamor
