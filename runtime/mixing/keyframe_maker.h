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
// Occlusion changes in steps, as rays are cast, so a voice's gain moves half of the way to its
// target at each keyframe. Each change of a source's power scale, and of the power of a moving
// source's reflection, follows the curve of a fade over kFadeKeyframes, so that voices that enter,
// leave and stay keep the total power that the sampler intends, within 0.3 dB.
//
// A moving source takes its voice along and moves on while it fades out; if it jumps, it is heard
// as two. It is heard at the position where the sound left it.
//
// A voice whose source and listener have not moved, and whose power gain, scale and fade are
// constant, keeps its values. All others are computed a tile of slots at a time by vector code
// (voice_kernel.h) from data prepared when they took their slots (voice_table.h). Intensity becomes
// amplitude there and nowhere else.
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

inline constexpr int kFadeKeyframes = 5;

class KeyframeMaker {
 public:
  // With one receiver, for panned and binaural output, both ears of a voice are equal, except for
  // the ITD of an HRTF.
  using Receivers = clamor::Receivers;

  // How a voice comes and goes: in so many keyframes, with constant power beside other voices, or
  // linearly beside a tap of the same source (field_maker.h).
  struct Fade {
    int keyframes = kFadeKeyframes;
    bool is_linear = false;
  };

  // `radiation` must outlive this. `slots` is how many voices may sound at once, including those
  // that fade out; a source waits if none is free.
  KeyframeMaker(const RadiationModel& radiation, std::size_t slots,
                Receivers receivers = Receivers::kPair, std::shared_ptr<const Hrtf> head = nullptr,
                OnsetSignals onsets = {}, Fade fade = {kFadeKeyframes, false});

  // Fills in the next keyframe: `sample` as a listener with these receivers hears it. The first
  // keyframe starts at full level. `keyframe.voices` must have capacity for all slots. The keyframe
  // is due `held_frames` later than its number says.
  void make(std::span<const SampledSource> sample, const Listener& listener, Keyframe& keyframe,
            const Reception& reception = Reception(), std::uint64_t held_frames = 0);

  // The signal that plays the beginning of another, as in the constructor's table.
  void set_onset(std::uint32_t signal, std::uint32_t onset) { onsets_[signal] = onset; }

  // ITDs of the HRTF, or null.
  const ItdTable* itd_table() const { return itd_table_.get(); }

 private:
  // Bound on the change of a delay per keyframe: a delay cannot shrink faster than time passes. A
  // source that approaches at half the speed of sound (kMaxSourceMach) stays below it.
  static constexpr double kMaxSlide_frames = 0.98 * kKeyframeFrames;

  // The power scale of a source, which follows the curve of a fade to its target.
  struct PowerScale {
    float target = 1;
    // Targets of the previous keyframes, the newest first.
    std::array<float, kFadeKeyframes - 1> previous_targets{};
    std::int8_t keyframes_left = 0;  // until the scale is at its target

    void set_target(float scale) {
      if (scale != target) keyframes_left = kFadeKeyframes;
      target = scale;
    }
    // The power that is scaled has changed to 1 / `ratio` of what it was; the product of both
    // follows the curve.
    void change_power(double ratio);
    // The scale of the next keyframe, while any are left.
    float next();
  };
  struct Slot {
    std::uint64_t number = 0;
    std::uint64_t last_chosen = 0;  // keyframe
    PowerScale scale;
    float rank = -1;
    std::int8_t fade = 0;  // of kFadeKeyframes; 0 is silence
    bool in_use = false;
    bool starts = false;   // with this keyframe
    bool frozen = false;   // its path jumped: fades out as it was
    bool changed = false;  // must be recomputed even if the listener stays
    bool moves = false;
    bool smooths = false;           // its power gain is moving to its target
    std::uint32_t loop = kNoOnset;  // the loop that follows while the voice plays an onset
  };
  // The free slots, and the slot of each source.
  struct SlotDirectory {
    struct Entry {
      std::uint64_t number;
      std::uint32_t slot;
    };
    std::vector<std::uint32_t> free;  // the lowest last
    std::size_t in_use = 0;
    std::size_t used = 0;                   // slots ever used; all others are free
    std::vector<Entry> by_number, updated;  // sorted by number; some no longer in use

    explicit SlotDirectory(std::size_t slots);
    std::uint32_t take();
    void give_back(std::uint32_t slot);
  };
  // The listener at this keyframe and at the one before.
  struct ListenerStep {
    ListenerFrame now{}, last{};
    Vec3 step_m{0, 0, 0};         // per keyframe, by the listener's velocity
    double max_slide_frames = 0;  // of delays, for this keyframe

    void set_step(const Vec3& next_step_m);
  };

  void apply_directivity(std::span<const std::uint32_t> slots);
  void place_all();
  void assign_slots(std::span<const SampledSource> sample);
  std::uint32_t start(const SampledSource& chosen);
  void begin_sound(std::uint32_t s, const SampledSource& chosen);
  void switch_to_loop(std::uint32_t s);
  bool keep(std::uint32_t s, const SampledSource& chosen);
  bool follow(std::uint32_t s, const SampledSource& chosen);
  void extrapolate(std::uint32_t s);
  void smooth_power_gain(std::uint32_t s);
  void update_scale(std::uint32_t s);
  MovingSourcePoint point_of(const SampledSource& chosen) const;
  bool slides_to(std::uint32_t s, const MovingSourcePoint& point, double emission_frames) const;
  static std::uint8_t rank_by_level(const Voice& voice);
  std::uint8_t rank_of(const Slot& slot, const Voice& voice) const;
  bool is_chosen(const Slot& slot) const { return slot.last_chosen == keyframe_count_; }
  float fade_gain(int keyframes) const;
  std::size_t make_tile(std::size_t first, bool still, Keyframe& keyframe, std::size_t count);

  const Receivers receivers_;
  const Fade fade_;
  const std::unique_ptr<const ItdTable> itd_table_;  // null without an HRTF
  OnsetSignals onsets_;
  Reception reception_;
  ListenerStep listener_;
  VoiceTable table_;
  SlotDirectory directory_;
  std::vector<Slot> slots_;
  std::vector<Voice> voices_;              // by slot: as in the last keyframe, before fading
  std::vector<Bands> power_gain_targets_;  // by slot
  std::uint64_t keyframe_count_ = 0;
  double due_frames_ = 0;  // time of the keyframe being made
};

}  // namespace clamor
