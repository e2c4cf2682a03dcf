// mixer.h: the audio thread's half: voices slide from keyframe to keyframe and add up.
//
// Time is a 64-bit count of frames; a voice reads its signal at that count less its delay, which is
// kept in 32.32 fixed point: phase cannot drift, however long it plays. Mixing goes in steps of
// kStepFrames on a grid fixed to the clock, several at once where that is asked for, and a mix is a
// function of its keyframes alone.
//
// From keyframe to keyframe gains slide in straight lines, and delays along two parabolas that meet
// after kKnotFrames, cut into steps: so that pitch slides too. The slope of a delay at a keyframe
// is told from that one and the two before, 1.5 and -0.5 of what the delay changed in between:
// exact for steady acceleration, and never ahead of time. A delay that would come near the speed of
// sound on the way goes in a straight line instead.
//
// Where two keyframes meet, gains are within 1e-6 of each other and delays within 2e-6 frames: the
// rounding of 960 small steps. A delay's slope steps by no more than it bends within kStepFrames.
// A gain's slope turns there by what the keyframes say, for a voice that fades (keyframe_maker.h)
// by at most 0.31 per 960 frames: no more than a step of -52 dB is at 1 kHz from the voice's own
// sound. With bands, gains and delays are those of lead_frames() before
// (0.5 ms with eight, 16 binaural), both of one moment; block_mixer.h makes up for it. What the
// eight bands' filters themselves take is left: a change is heard 0.2 ms late at 8 kHz, 0.8 at
// 2 kHz, 2 at 1 kHz and 24 at 125 Hz, two or three periods. A head's have no phase and take none.
//
// More than two channels are mixed pair by pair from the same paths, each pair from those voices
// that are heard in it: a voice has one delay and one spectrum, times a gain per channel that the
// panner tells from its direction at each keyframe. So those gains slide as all do.
//
// Binaural, a voice's gains are its octaves times what the head does to its direction, also told at
// each keyframe: in the bands of hrtf_filter_bank.h for the loudest voices (narrowband_voices.h),
// in octaves for the others, whose sum gets its narrow bands as a whole (diffuse_hrtf_eq.h). The
// time between the ears is in its delays; low frequencies have more of it, also told at each
// keyframe, so that the low layer's delays go apart from the high one's in straight lines.
//
// A head that turns is followed between keyframes, where that is asked for: voices are turned from
// the facing for which their keyframe was made to the newest one, at once at a keyframe and
// otherwise at the next third of the way to the next one (mixer_head_rotation.cpp). Where no
// keyframe comes, voices stay but the head still turns.
//
// Where there is no time for all voices, those of the highest ranks fade out within kShedFrames and
// are not mixed from there on, though their delays go on; they slide back in from a keyframe on.
//
// Threads: load(), hold(), allow(), mix() and step() are the audio thread's; begin() comes before
// them. Cost: tests/benchmarks/mixer_benchmark.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "runtime/hrtf/diffuse_hrtf_eq.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/hrtf/hrtf_filter_bank.h"
#include "runtime/mixing/head_rotation.h"
#include "runtime/mixing/panner.h"
#include "runtime/realtime/realtime.h"
#include "runtime/streaming/prepared_signal.h"
#include "runtime/voices/gain_ramp_kernel.h"
#include "runtime/voices/keyframe.h"
#include "runtime/voices/mix_kernel.h"
#include "runtime/voices/narrowband_voices.h"
#include "runtime/voices/octave_filter_bank.h"

namespace clamor {

class Mixer {
 public:
  // `signals`, prepared for the same mode, must outlive the mixer, and so must `panner`, which has
  // the mode's channels, and `head`, where the mode has one; without either, a voice has its own
  // gains for two. Keyframes may use slots 0
  // to slots - 1. With `turns`, which must outlive it too, face() is followed.
  Mixer(std::span<const PreparedSignal> signals, std::size_t slots, const MixMode& mode = {},
        const Panner* panner = nullptr, const Hrtf* head = nullptr,
        const HeadRotation* turns = nullptr);

  int channels() const noexcept REALTIME { return kEars * mode_.pairs; }

  // Gains and delays are those of so many frames before: filters take as long.
  int lead_frames() const noexcept REALTIME { return lead_frames_; }

  // Everything sounds as `keyframe` says, and has for kBankTailFrames before `clock_frames`.
  void begin(const Keyframe& keyframe, std::int64_t clock_frames);

  // True at the end of a segment: load() the next keyframe, or hold() for one step, or for
  // kShedFrames where voices must fade out.
  bool wants_keyframe() const noexcept REALTIME { return frames_left() == 0; }
  void load(const Keyframe& keyframe) noexcept REALTIME;
  void hold() noexcept REALTIME;
  bool holds() const noexcept REALTIME { return holding_; }

  // Until it wants a keyframe.
  int frames_left() const noexcept REALTIME { return kKeyframeFrames - elapsed_ - frame_; }

  // The newest facing of the listener. Then, before each mix(), where no keyframe is wanted,
  // turn(); and in place of hold(), rotate_while_holding(), which returns false where there is
  // nothing to turn. True where voices have been taken anew.
  void face(const ListenerAxes& facing) noexcept REALTIME { facing_ = facing; }
  bool turn() noexcept REALTIME;
  bool rotate_while_holding() noexcept REALTIME;

  // At most about so many voices of a keyframe are to sound: to a 255th of them, as ranks are.
  void allow(std::size_t voices) noexcept REALTIME;
  std::size_t voices() const noexcept REALTIME { return loaded_; }      // of the newest keyframe
  std::size_t left_out() const noexcept REALTIME { return left_out_; }  // of those
  std::size_t sounding() const noexcept REALTIME { return active_.size(); }  // fading ones too

  // Steps that one mix() may take now.
  int steps_left() const noexcept REALTIME {
    const int knot = frame_ < segment_.knot ? segment_.knot : segment_.frames;
    int end = frame_ < shed_end_ ? std::min(knot, shed_end_) : knot;
    if (turns_ != nullptr) end = std::min(end, frame_ + frames_to_next_third());
    return std::min(kMostSteps, (end - frame_) / kStepFrames);
  }

  // Mixes the next so many steps into interleaved (left, right), overwriting it.
  void mix(float* interleaved, int steps) noexcept REALTIME;
  void step(float* interleaved) noexcept REALTIME { mix(interleaved, 1); }

  std::int64_t clock_frames() const { return clock_; }

  // What was done so far, which is what time goes into: frames of voices added up, once for each
  // pair of channels and each bank of bands that hears them, and voices taken from keyframes.
  struct Work {
    std::uint64_t voice_frames = 0, loaded_voices = 0;
  };
  Work work() const noexcept REALTIME { return work_; }

  // Voices silenced because a gain or delay was not finite or beyond all measure, or a delay slid
  // beyond real time.
  std::uint64_t bad_voices() const noexcept REALTIME { return bad_voices_; }
  // Voices held back, each for a keyframe, because what they read is not decoded yet.
  std::uint64_t late_voices() const noexcept REALTIME { return late_voices_; }

 private:
  static constexpr int kShedFrames = 512;  // their gains turn six times as much as those of fades

  // A stretch in which gains slide in straight lines and delays along two parabolas, of m and n
  // steps, which meet at the knot. It is a whole period, from keyframe to keyframe, or a part of
  // one.
  struct Segment {
    int frames = 0, knot = 0;
    double per_frame = 0, per_m = 0, per_n = 0, share_m = 0, share_n = 0;
  };
  static constexpr Segment segment_of(int frames, int knot) noexcept REALTIME {
    const double m = 1.0 * knot / kStepFrames, n = 1.0 * frames / kStepFrames - m;
    return {frames, knot, 1.0 / frames, 1 / m, 1 / n, m / (m + n), n / (m + n)};
  }
  static constexpr Segment whole_segment() noexcept REALTIME {
    return segment_of(kKeyframeFrames, 512);
  }

  // Of a delay, per frame: of its whole last segment, and at its end.
  struct Slide {
    double mean = 0, end = 0;
  };
  struct Parabola {
    std::int64_t step = 0, bend = 0;  // VoicePath's
  };
  struct Slot {
    const PreparedSignal* signal = nullptr;
    std::array<Slide, kEars> slide{};
    std::array<Parabola, kEars> after_knot{};
    // 32.32 fixed point: the delay at the end of the segment; where it is read next, if it plays
    // once.
    std::array<std::int64_t, kEars> delay{}, position{};
    std::uint32_t direction = 0;  // where the head's mesh has it
    std::uint8_t rank = 0;
    bool heard = false;                 // since the last keyframe, with gains that are not all zero
    std::uint8_t steps_to_silence = 0;  // while it holds and its sound ends; 0: it does not
  };

  void activate(std::uint32_t slot) noexcept REALTIME;
  void mix_head(int frames, float* interleaved) noexcept REALTIME;
  void mix_pair(std::size_t pair, int frames, float* interleaved) noexcept REALTIME;
  void advance_once(int frames) noexcept REALTIME;
  void advance(int frames) noexcept REALTIME;
  void clear_active() noexcept REALTIME;
  void rank_voices(const Keyframe& keyframe) noexcept REALTIME;
  std::uint8_t rank_for(std::size_t voices) const noexcept REALTIME;
  void fade_above(std::uint8_t rank) noexcept REALTIME;
  int slide_frames(const Voice& voice) const noexcept REALTIME {
    return voice.rank > highest_rank_ ? std::min(kShedFrames, segment_.frames) : segment_.frames;
  }
  void load_segment(std::span<const Voice> voices, int elapsed, int frames) noexcept REALTIME;

  // In mixer_head_rotation.cpp.
  void make_room_for_turns();
  void keep(const Keyframe& keyframe) noexcept REALTIME;
  bool has_turned() const noexcept REALTIME;
  void cut() noexcept REALTIME;
  Voice interpolated_voice(const Voice& voice, const HeadRotation::Turn& turn,
                           const HeadRotation::Turn& previous_turn) const noexcept REALTIME;
  int frames_to_next_third() const noexcept REALTIME {
    constexpr int kThird = kKeyframeFrames / 3;
    return kThird - (elapsed_ + frame_) % kThird;
  }

  // Calls change(targets, gains, lanes) for all in which a slot is heard.
  template <class Change>
  void change_gains(std::uint32_t slot, const Change& change) noexcept REALTIME {
    const auto lanes = static_cast<std::size_t>(lanes_);
    for (Pair& pair : pairs_)
      change(&pair.targets[slot * lanes], &pair.gains[2 * slot * lanes], lanes);
    if (fine_ != nullptr)
      fine_->change(slot, [&](float* target, float* gain) noexcept REALTIME {
        change(target, gain, std::size_t{kHrtfLanes});
      });
  }
  void drop_shed() noexcept REALTIME;

  // In mixer_keyframes.cpp.
  float power_of(const Voice& voice) const noexcept REALTIME;
  void choose_fine(const Keyframe& keyframe) noexcept REALTIME;
  bool set_colours(const Voice& voice, bool usable,
                   const DirectionMesh::Place& place) noexcept REALTIME;
  void set_layer_offset(std::uint32_t slot, std::int64_t from, std::int64_t to) noexcept REALTIME;
  void prefetch(std::uint32_t slot) const noexcept REALTIME;
  void load_voice(const Voice& voice) noexcept REALTIME;
  void slide(Slide& slide, VoicePath& path, Parabola& after_knot, double change_frames,
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
  bool is_here(std::uint32_t slot, const std::array<std::int64_t, kEars>& from,
               const std::array<double, kEars>& change_frames, int frames) const noexcept REALTIME;
  bool may_sound(std::uint32_t slot, const std::array<std::int64_t, kEars>& from,
                 const std::array<double, kEars>& change_frames) noexcept REALTIME;
  void silence(std::uint32_t slot) noexcept REALTIME;
  bool hold_sounds() noexcept REALTIME;
  void end_hold() noexcept REALTIME;

  std::span<const PreparedSignal> signals_;
  const MixMode mode_;
  const MixMode bus_mode_;  // of voices that add to buses of octaves, or to one
  const Panner* const panner_;
  const Hrtf* const head_;
  const int lanes_;
  const int lead_frames_;  // by which reading is ahead of what comes out
  BusGains bus_gains_;

  // By slot.
  std::vector<Slot> slots_;
  std::vector<VoicePath> paths_;
  std::vector<LayerOffset> gaps_;       // with a head, as are the next
  std::vector<std::int64_t> gap_ends_;  // what is ahead at the end of the segment
  std::vector<std::int64_t> wraps_;     // where its signal comes round, 32.32; or never

  std::vector<std::uint32_t> active_;  // slots that sound in this segment, in the keyframe's order
  std::vector<std::uint32_t> once_;    // those of them whose signals play once
  // Two channels.
  struct Pair {
    std::vector<float> targets;         // [slot][lanes_]: gains at the end of the segment
    std::vector<float> gains;           // MixJob
    std::vector<std::uint32_t> active;  // those of active_ that it hears, where they may be fewer
    OctaveFilterBank bank;
  };
  std::vector<Pair> pairs_;
  MixBuses buses_;
  std::unique_ptr<HrtfFilterBank> head_bank_;
  std::unique_ptr<NarrowbandVoices> fine_;
  std::unique_ptr<DiffuseHrtfEq> crowd_;
  std::int64_t clock_ = 0;
  Segment segment_ = whole_segment();
  int elapsed_ = 0;       // frames of the period before the segment
  int frame_ = 0;         // of the segment
  bool holding_ = false;  // slopes are zero until the next keyframe
  std::uint64_t bad_voices_ = 0, late_voices_ = 0;
  Work work_;

  std::size_t allowed_ = std::numeric_limits<std::size_t>::max();
  std::size_t loaded_ = 0, left_out_ = 0;
  std::uint8_t highest_rank_ = kHighestRank;  // that sounds, or does when those above have faded
  int shed_end_ = 0;                          // frame_ at which they have
  std::array<std::uint32_t, kHighestRank + 1> up_to_rank_{};  // voices of the keyframe

  // For a head that turns; null and empty where it is not followed.
  struct Kept {
    std::vector<Voice> voices;
    ListenerAxes facing;
  };
  const HeadRotation* const turns_;
  ListenerAxes facing_, applied_;           // the newest, and that of the segment's end
  Kept previous_, current_;                 // the keyframes between which voices are
  std::vector<std::uint32_t> previous_at_;  // by slot: in previous_.voices
};

}  // namespace clamor
