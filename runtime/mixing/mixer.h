// mixer.h: the inner half of the audio thread: interpolates voices between keyframes and sums them.
//
// Time is a 64-bit count of frames. A voice reads its signal at that count less its delay, which is
// 40.24 fixed point, so phase does not drift, and a sound may begin up to 66 days after the clock
// does. Mixing works in steps of kStepFrames on a grid fixed to the clock, several steps per call
// if asked for. The output is a function of the keyframes alone.
//
// Between keyframes gains are linear, and delays follow two parabolas that meet at a knot, so that
// pitch is continuous. With bands, gains and delays are both those of lead_frames() before (0.5 ms
// with eight bands, 16 ms binaural); block_mixer.h compensates for that. runtime/README.md,
// "Mixing", gives the errors of the interpolation and the delay of each band's filter.
//
// More than two channels are mixed pair by pair, each pair from the voices that it hears, with the
// panner's gain per channel. Binaural voices have their octave gains times the HRTF's gains at
// their direction, in narrow bands for the loudest voices (narrowband_voices.h) and in octaves for
// the others (diffuse_hrtf_eq.h), and delays that include the ITD.
//
// Head rotation is followed between keyframes if asked for (mixer_head_rotation.cpp). If no
// keyframe comes, sources stand still but the head still turns. When there is no time for all
// voices, those with the highest ranks fade out within kShedFrames, and in again at a keyframe.
//
// Threads: load(), hold(), allow(), mix() and step() run on the audio thread, begin() before it.
// Cost: `clamor bench mixer` prints it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/field/field_mixer.h"
#include "runtime/hrtf/diffuse_hrtf_eq.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/hrtf/hrtf_filter_bank.h"
#include "runtime/mixing/head_tracker.h"
#include "runtime/mixing/mixer_timeline.h"
#include "runtime/mixing/panner.h"
#include "runtime/mixing/voice_shedding.h"
#include "runtime/realtime/realtime.h"
#include "runtime/streaming/playable_signals.h"
#include "runtime/voices/gain_ramp_kernel.h"
#include "runtime/voices/keyframe.h"
#include "runtime/voices/mix_kernel.h"
#include "runtime/voices/narrowband_voices.h"
#include "runtime/voices/octave_filter_bank.h"

namespace clamor {

class Mixer {
 public:
  // All references and pointers must outlive the mixer. `signals` must be prepared for the same
  // mode; `panner` must have the mode's channels; `head` is needed for a binaural mode. Without
  // panner and head, a voice has its own gains for two channels. Keyframes may use slots 0 to slots
  // - 1. With `turns`, turn_head() is followed.
  Mixer(PlayableSignals signals, std::size_t slots, const MixMode& mode = {},
        const Panner* panner = nullptr, const Hrtf* head = nullptr,
        const HeadRotation* turns = nullptr);

  static constexpr int kDelayBits = 24;  // of a delay's fraction, in fixed point

  int channels() const noexcept REALTIME { return kEars * mode_.pairs; }

  // Latency of the filters: gains and delays are those of this many frames before.
  int lead_frames() const noexcept REALTIME { return lead_frames_; }

  // Starts as if `keyframe` had held for as long before `clock_frames` as filters can sound.
  void begin(const Keyframe& keyframe, std::int64_t clock_frames);

  // True at the end of a segment. Call load() with the next keyframe, or hold(), which lasts one
  // step, or kShedFrames while voices fade out.
  bool wants_keyframe() const noexcept REALTIME { return frames_left() == 0; }
  void load(const Keyframe& keyframe) noexcept REALTIME;
  void hold() noexcept REALTIME;
  bool holds() const noexcept REALTIME { return time_.holding; }

  // Until it wants a keyframe.
  int frames_left() const noexcept REALTIME { return time_.frames_left(); }

  // turn_head() sets the listener's newest axes. Before each mix(), follow_head() applies them if
  // no keyframe is wanted; rotate_while_holding() may take the place of hold() and returns false if
  // there is no rotation. Both return whether voices have changed.
  void turn_head(const ListenerAxes& axes) noexcept REALTIME { tracker_.turn_head(axes); }
  bool follow_head() noexcept REALTIME;
  bool rotate_while_holding() noexcept REALTIME;

  // Limits how many voices of a keyframe may sound, to within a 255th of them, the resolution of
  // ranks.
  void allow(std::size_t voices) noexcept REALTIME;
  std::size_t voices() const noexcept REALTIME {
    return shedding_.loaded();
  }                                                                        // of the newest keyframe
  std::size_t shed() const noexcept REALTIME { return shedding_.shed(); }  // of those
  std::size_t sounding() const noexcept REALTIME {
    return active_.size();
  }  // including those that fade out

  // The largest number of steps that mix() takes now.
  int steps_left() const noexcept REALTIME {
    int frames = time_.frames_to_bend();
    if (tracker_.is_on()) frames = std::min(frames, time_.frames_to_next_third());
    if (field_ != nullptr) frames = std::min(frames, field_->frames_left());
    return std::min(kMaxSteps, frames / kStepFrames);
  }

  // Mixes the next steps into interleaved (left, right), overwriting it.
  void mix(float* interleaved, int steps) noexcept REALTIME;
  void step(float* interleaved) noexcept REALTIME { mix(interleaved, 1); }

  std::int64_t clock_frames() const { return time_.clock_frames; }

  // Work done so far, to which time is proportional: voices times frames, counted once per pair of
  // channels and per filter bank, and voices loaded from keyframes.
  struct Work {
    std::uint64_t voice_frames = 0, loaded_voices = 0;
  };
  Work work() const noexcept REALTIME { return work_; }

  // Voices muted because a gain or delay was not finite or out of range, or a delay changed faster
  // than real time.
  std::uint64_t bad_voices() const noexcept REALTIME { return muted_.bad; }
  // Voices muted, each counted once per keyframe, because their signal is not decoded yet.
  std::uint64_t late_voices() const noexcept REALTIME {
    return muted_.late + (field_ == nullptr ? 0 : field_->late_blocks());
  }

 private:
  static constexpr int kShedFrames = 512;  // a slope six times that of a fade

  // Slope of a delay per frame: mean over the last segment, and at its end.
  struct DelaySlope {
    double mean = 0, end = 0;
  };
  struct Parabola {
    std::int64_t step = 0, bend = 0;  // as in VoicePath
  };
  struct Slot {
    const PreparedSignal* signal = nullptr;
    std::array<DelaySlope, kEars> slopes{};
    std::array<Parabola, kEars> after_knot{};
    // The delay at the end of the segment, 40.24 fixed point, and the next read position if the
    // signal plays once, 32.32.
    std::array<std::int64_t, kEars> delay{}, position{};
    std::uint32_t direction = 0;  // triangle of the HRTF's mesh, to start the next search
    std::uint8_t rank = 0;
    bool audible = false;               // since the last keyframe: some gain is not 0
    std::uint8_t steps_to_silence = 0;  // while it holds and its sound ends; otherwise 0
  };

  void activate(std::uint32_t slot) noexcept REALTIME;
  void mix_binaural(int frames, float* interleaved) noexcept REALTIME;
  void mix_pair(std::size_t pair, int frames, float* interleaved) noexcept REALTIME;
  void advance_once(int frames) noexcept REALTIME;
  void advance(int frames) noexcept REALTIME;
  void clear_active() noexcept REALTIME;
  void fade_above(std::uint8_t rank) noexcept REALTIME;
  int slide_frames(const Voice& voice) const noexcept REALTIME {
    return shedding_.sheds(voice.rank) ? std::min(kShedFrames, time_.segment.frames)
                                       : time_.segment.frames;
  }
  void load_segment(std::span<const Voice> voices, int elapsed, int frames) noexcept REALTIME;

  // In mixer_head_rotation.cpp.
  bool has_turned() const noexcept REALTIME {
    return tracker_.has_turned() && shedding_.shed() == 0;
  }
  void end_segment_here() noexcept REALTIME;

  // Calls change(targets, gains, lanes) for all buses in which a slot is audible.
  template <class Change>
  void change_gains(std::uint32_t slot, const Change& change) noexcept REALTIME {
    const auto lanes = static_cast<std::size_t>(layout_.lanes);
    for (Pair& pair : pairs_)
      change(&pair.targets[slot * lanes], &pair.gains[2 * slot * lanes], lanes);
    if (binaural_ != nullptr)
      binaural_->narrowband.change(slot, [&](float* target, float* gain) noexcept REALTIME {
        change(target, gain, std::size_t{kHrtfLanes});
      });
  }
  // No longer mixes voices whose slots satisfy the condition.
  template <class Condition>
  void drop_if(const Condition& is_dropped) noexcept REALTIME {
    std::erase_if(active_, is_dropped);
    std::erase_if(once_, is_dropped);
    for (Pair& pair : pairs_) std::erase_if(pair.active, is_dropped);
    if (binaural_ != nullptr) binaural_->narrowband.drop(is_dropped);
  }
  void drop_shed() noexcept REALTIME;

  // In mixer_keyframes.cpp.
  float power_of(const Voice& voice) const noexcept REALTIME;
  void choose_narrowband(const Keyframe& keyframe) noexcept REALTIME;
  bool set_hrtf_gains(const Voice& voice, bool usable,
                      const DirectionMesh::Place& place) noexcept REALTIME;
  void set_layer_offset(std::uint32_t slot, std::int64_t from, std::int64_t to) noexcept REALTIME;
  void prefetch(std::uint32_t slot) const noexcept REALTIME;
  void load_voice(const Voice& voice) noexcept REALTIME;
  void slide(DelaySlope& slope, VoicePath& path, Parabola& after_knot, double change_frames,
             bool starts) noexcept REALTIME;
  template <std::size_t kDelays>
  void place(Slot& slot, VoicePath* paths,
             const std::array<std::int64_t, kDelays>& delay) noexcept REALTIME;
  template <std::size_t kDelays>
  bool slide_to(const Voice& voice) noexcept REALTIME;
  void stay(std::uint32_t slot) noexcept REALTIME;
  void hold_gains(std::uint32_t slot) noexcept REALTIME;
  void set_targets(const std::array<Bands, kEars>& gain, float* targets) const noexcept REALTIME;
  GainRamps gain_ramps(std::size_t pair, const Voice& voice,
                       const float* targets) noexcept REALTIME;

  // In mixer_streaming.cpp.
  bool is_resident(std::uint32_t slot, const std::array<std::int64_t, kEars>& from,
                   const std::array<double, kEars>& change_frames,
                   int frames) const noexcept REALTIME;
  bool may_sound(std::uint32_t slot, const std::array<std::int64_t, kEars>& from,
                 const std::array<double, kEars>& change_frames) noexcept REALTIME;
  void silence(std::uint32_t slot) noexcept REALTIME;
  bool hold_sounds() noexcept REALTIME;
  void end_hold() noexcept REALTIME;

  // State of binaural output.
  struct Binaural {
    Binaural(const Hrtf& head, std::size_t slots, std::size_t narrowband_voices)
        : hrtf(head),
          narrowband(slots, narrowband_voices),
          diffuse_eq(head),
          offsets(slots),
          offset_ends(slots) {}

    const Hrtf& hrtf;
    HrtfFilterBank bank;
    NarrowbandVoices narrowband;
    DiffuseHrtfEq diffuse_eq;
    std::vector<LayerOffset> offsets;       // by slot
    std::vector<std::int64_t> offset_ends;  // by slot: the offset at the end of the segment
  };

  // Two output channels.
  struct Pair {
    std::vector<float> targets;  // [slot][layout_.lanes]: gains at the end of the segment
    std::vector<float> gains;    // as in MixJob
    // Voices of active_ that are audible in these channels, where they may be fewer.
    std::vector<std::uint32_t> active;
    OctaveFilterBank bank;
  };

  struct MutedVoices {
    std::uint64_t bad = 0, late = 0;
  };
  // Buses of octaves or of the full band.
  struct BusLayout {
    MixMode mode;
    int lanes = 0;  // of gains, per voice
    BusGains gains;
  };

  const PlayableSignals signals_;
  const MixMode mode_;
  const BusLayout layout_;
  const Panner* const panner_;
  const int lead_frames_;                     // by which reading is ahead of the output
  const std::unique_ptr<Binaural> binaural_;  // or null
  const std::unique_ptr<FieldMixer> field_;   // or null

  // By slot.
  std::vector<Slot> slots_;
  std::vector<VoicePath> paths_;
  std::vector<std::int64_t> wraps_;  // where its signal wraps, 32.32; or never

  std::vector<std::uint32_t> active_;  // slots that sound in this segment, in the keyframe's order
  std::vector<std::uint32_t> once_;    // those of them whose signals play once
  std::vector<Pair> pairs_;
  MixBuses buses_;

  MixerTimeline time_;
  VoiceShedding shedding_;
  HeadTracker tracker_;
  MutedVoices muted_;
  Work work_;
};

}  // namespace clamor
