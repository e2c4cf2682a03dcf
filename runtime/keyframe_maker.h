// keyframe_maker.h: from samples of sources to keyframes of voices.
//
// A source that is chosen gets a slot and keeps it while it is heard, so that its gains and delays
// slide. One that enters or leaves the sample fades over kFadeKeyframes (100 ms) with equal power:
// sin^2 + cos^2, for the one that takes its place. A source that stays but whose path jumps (the
// listener was moved, not walking) fades out where it was and in where it is now.
//
// What is hidden comes and goes in steps, as rays are cast; a voice's visibility glides there, half
// the way each keyframe. So do the factors that tell what a source stands for, as tau changes with
// k or as the listener walks: half of their logarithm's way.
//
// A source that moves takes its voice along, so that its delays slide, and goes on as it went while
// it fades out; where it jumps it is heard as two.
//
// A voice whose source and ears are as they were keeps its numbers: who stands still costs nothing.
// Intensity becomes amplitude here and nowhere else.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/pose.h"
#include "runtime/head.h"
#include "runtime/keyframe.h"
#include "runtime/sampler.h"
#include "runtime/source_field.h"

namespace clamor {

inline constexpr double kEarDistance_m = 0.17;  // between the two receivers
inline constexpr int kFadeKeyframes = 5;

class KeyframeMaker {
 public:
  // What the listener's receivers are: two, each at its own place and alike from everywhere, or one
  // in the middle, for output that is panned; then both ears of a voice are the same, but for the
  // time between them if there is a head.
  enum class Receivers : std::uint8_t { kPair, kOne };

  // `field` must outlive the maker. `slots` is how many voices may sound at once, fading ones
  // included; a source that finds none free waits until one is.
  KeyframeMaker(const SourceField& field, std::size_t slots, Receivers receivers = Receivers::kPair,
                std::shared_ptr<const Head> head = nullptr);

  // Fills in the next keyframe: what `sample` sounds like at `pose`. The first starts at full
  // level. `keyframe.voices` has room for all slots.
  void make(std::span<const SampledSource> sample, const Pose& pose, Keyframe& keyframe);

 private:
  struct Stance {
    Vec3 centre_m;
    std::array<Vec3, kEars> ears_m;
    Vec3 ahead, left, up;
    bool operator==(const Stance&) const = default;
  };

  struct Slot {
    std::uint64_t number = 0;
    Source source;  // a copy: its page may be gone while it fades
    int fade = 0;   // of kFadeKeyframes; 0 is silence
    bool in_use = false;
    bool chosen = false;   // in the present sample
    bool frozen = false;   // its path jumped: fades out as it was
    bool changed = false;  // since listen(), though the ears may be where they were
    double power_scale = 1, power_scale_goal = 1;
    double rank = -1;
    bool moves = false;
    Vec3f moved_m{};  // per keyframe
    Bands visibility = same_in_all_bands(1), visibility_goal = same_in_all_bands(1);
    Voice voice;  // as in the last keyframe, before fading
  };

  Stance head_at(const Pose& pose) const;
  double delay_frames(const Source& source, const Stance& head, int ear) const;
  void listen(Slot& slot, const Stance& head) const;
  static void see(Slot& slot);
  static void weigh(Slot& slot);
  static std::uint8_t rank_of(const Slot& slot);
  void start(const SampledSource& chosen, const Stance& head);
  static Vec3f direction_from(const Source& source, const Stance& head);
  bool jumped(const Slot& slot, const Stance& head) const;
  bool follow(Slot& slot, const SampledSource& chosen, const Stance& head);
  void coast(Slot& slot, const Stance& head);
  void freeze(Slot& slot);

  const SourceField& field_;
  const Receivers receivers_;
  const std::shared_ptr<const Head> ears_;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_;                                  // slots, lowest last
  std::unordered_map<std::uint64_t, std::uint32_t> slot_of_number_;  // of sources that are heard
  Stance last_head_{};
  Vec3 last_step_m_{0, 0, 0};
  double fastest_slide_frames_ = 0;  // of this keyframe
  std::uint64_t made_ = 0;
};

}  // namespace clamor
