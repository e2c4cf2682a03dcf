// motion_scene.h: a listener who goes round and round in a level, and what is heard of it from any
// moment on.
//
// A track is what the player does, without its threads: a sample, a keyframe and 20 ms of sound at
// a time. What all sources give from some moment on does not depend on what was before, so they
// need not be mixed all the way to be compared with: a track may begin anywhere.
//
// Signals play for as long as one goes: all of them are loops here.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/listener.h"
#include "formats/audio/audio_file.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/mixing/mixer.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/sampling/strategies.h"
#include "runtime/streaming/prepared_signal.h"

namespace clamor {

// Two circles of different periods, within the middle of where sources are.
class Way {
 public:
  Way(const std::vector<Source>& sources, const Vec3& start);

  // Along it at a steady speed, nearly: the large circle's.
  Listener at(double way_m) const;

 private:
  Vec3 start_;
  double large_m_ = 1, small_m_ = 1;
};

// A level that one can walk through. With a `roll` other than 0 reflections have other signs and
// emitters other delays, within the span of those that they have: as exact, but for chance.
class MotionScene {
 public:
  explicit MotionScene(AuralizerInput input, std::uint64_t roll = 0);
  MotionScene(const MotionScene&) = delete;
  MotionScene& operator=(const MotionScene&) = delete;

  std::unique_ptr<Sampler> sampler(const std::string& strategy, std::size_t voices) const;
  const RadiationModel& field() const { return field_; }
  const std::vector<PreparedSignal>& signals() const { return signals_; }

  // What all voices of a keyframe add up to on average over all phases, weighed as loudness is,
  // with what each plays at that time. Interference is not in it.
  double power(const Keyframe& keyframe, double time_s) const;

 private:
  AuralizerInput input_;
  std::vector<PreparedSignal> signals_;
  RadiationModel field_;
  SignalWeights weights_;  // as the player weighs them
  SignalWeights moments_;  // as they are
  std::shared_ptr<SourceList> list_;
};

// What is heard from a keyframe on, so many of them long, and each one's power: of a track that has
// been under way for a while, so that all glides and fades have settled.
struct Stretch {
  Sound sound;
  std::vector<double> powers;
};
Stretch render_segment(const MotionScene& scene, const Way& way, double speed_mps,
                       const std::string& strategy, std::size_t voices,
                       std::uint64_t first_keyframe, std::size_t keyframes);

class MotionTrack {
 public:
  // Begins at a keyframe. `scene` must outlive it.
  MotionTrack(const MotionScene& scene, const Way& way, double speed_mps,
              const std::string& strategy, std::size_t voices, std::uint64_t first_keyframe = 0);

  // What is heard until the next keyframe, appended, and that keyframe's power.
  void next(Sound& sound, std::vector<double>& powers);

 private:
  void make_keyframe();
  double time_s() const { return static_cast<double>(number_) * kKeyframe_s; }

  const MotionScene& scene_;
  const Way& way_;
  const double speed_mps_;
  ListenerMotion motion_{kKeyframe_s};
  const std::unique_ptr<Sampler> sampler_;
  KeyframeMaker maker_;
  Mixer mixer_;
  Keyframe keyframe_;
  std::uint64_t number_;  // of the way; the maker counts from where the track begins
};

}  // namespace clamor
