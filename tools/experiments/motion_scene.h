// motion_scene.h: renders a listener who moves through a level, from any moment on.
//
// A track does what the player does, without its threads: a sample, a keyframe and 20 ms of sound
// at a time. The sound of all sources does not depend on the past, so a track may begin anywhere,
// and comparing with all sources does not require mixing the whole path.
//
// All signals are played as loops.
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
#include "runtime/streaming/prepared_signal.h"
#include "tools/strategies/strategies.h"

namespace clamor {

// A path of two superposed circles of different periods, around the middle of the sources.
class ListenerPath {
 public:
  ListenerPath(const std::vector<Source>& sources, const Vec3& start);

  // Position after a distance along the path. The speed is nearly constant: that of the large
  // circle.
  Listener at(double distance_m) const;

 private:
  Vec3 start_;
  double large_m_ = 1, small_m_ = 1;
};

// A level to move through. A `roll` other than 0 draws other polarities of secondary sources and
// other emitter delays within their range: an equally exact scene with other interference.
class MotionScene {
 public:
  explicit MotionScene(AuralizerInput input, std::uint64_t roll = 0);
  MotionScene(const MotionScene&) = delete;
  MotionScene& operator=(const MotionScene&) = delete;

  std::unique_ptr<Sampler> sampler(const std::string& strategy, std::size_t voices) const;
  const RadiationModel& radiation() const { return radiation_; }
  const std::vector<PreparedSignal>& signals() const { return signals_; }

  // Loudness-weighted power of all voices of a keyframe at that time, averaged over phases, so
  // without interference.
  double power(const Keyframe& keyframe, double time_s) const;

 private:
  AuralizerInput input_;
  std::vector<PreparedSignal> signals_;
  RadiationModel radiation_;
  SignalWeights weights_;  // smoothed over time, as in the player
  SignalWeights moments_;  // momentary
  std::shared_ptr<SourceList> list_;
};

// Sound of a number of keyframes from a given one on, and the power of each. The track starts
// earlier, so that all ramps and fades have settled.
struct RenderedSegment {
  Sound sound;
  std::vector<double> powers;
};
RenderedSegment render_segment(const MotionScene& scene, const ListenerPath& path, double speed_mps,
                               const std::string& strategy, std::size_t voices,
                               std::uint64_t first_keyframe, std::size_t keyframes);

class MotionTrack {
 public:
  // Begins at a keyframe. `scene` and `path` must outlive the track.
  MotionTrack(const MotionScene& scene, const ListenerPath& path, double speed_mps,
              const std::string& strategy, std::size_t voices, std::uint64_t first_keyframe = 0);

  // Appends the sound up to the next keyframe and that keyframe's power.
  void next(Sound& sound, std::vector<double>& powers);

 private:
  void make_keyframe();
  double time_s() const { return static_cast<double>(number_) * kKeyframe_s; }

  const MotionScene& scene_;
  const ListenerPath& path_;
  const double speed_mps_;
  ListenerMotion motion_{kKeyframe_s};
  const std::unique_ptr<Sampler> sampler_;
  KeyframeMaker maker_;
  Mixer mixer_;
  Keyframe keyframe_;
  std::uint64_t number_;  // keyframe along the path; the maker counts from the start of the track
};

}  // namespace clamor
