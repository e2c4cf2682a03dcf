// motion_scene.h: renders a listener who moves through a level, from any moment on.
//
// The sound of all sources does not depend on the past, so a track may begin anywhere, and
// comparing with all sources does not require mixing the whole path.
//
// All signals are played as loops.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/voices/keyframe.h"
#include "tools/experiments/experiment_scene.h"

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

// A level to move through, with weights smoothed over time, as in the player. A `roll` other than 0
// draws other polarities of secondary sources and other emitter delays within their range: an
// equally exact scene with other interference.
class MotionScene : public ExperimentScene {
 public:
  explicit MotionScene(const AuralizerInput& input, std::uint64_t roll = 0);

  // Loudness-weighted power of all voices of a keyframe at that time, averaged over phases, so
  // without interference.
  double power(const Keyframe& keyframe, double time_s) const;

 private:
  const SignalWeights moments_;  // momentary
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

}  // namespace clamor
