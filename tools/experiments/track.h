// track.h: plays a scene from any moment on, as the player does.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/listener.h"
#include "formats/audio/audio_file.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/mixing/mixer.h"

namespace clamor {

// Position of a listener at a time in seconds.
using ListenerAt = std::function<Listener(double)>;

// Does what the player does, without its threads: a sample, a keyframe and 20 ms of sound at a
// time.
class Track {
 public:
  // Begins at a keyframe. Everything must outlive the track.
  Track(const RadiationModel& radiation, const std::vector<PreparedSignal>& signals,
        Sampler& sampler, ListenerAt listener, std::uint64_t first_keyframe = 0);

  // Appends the sound up to the next keyframe, which is returned.
  const Keyframe& next(Sound& sound);
  double time_s() const { return static_cast<double>(number_) * kKeyframe_s; }

 private:
  void make_keyframe();

  Sampler& sampler_;
  const ListenerAt listener_;
  ListenerMotion motion_{kKeyframe_s};
  KeyframeMaker maker_;
  Mixer mixer_;
  Keyframe keyframe_;
  std::uint64_t number_;  // keyframe along the way; the maker counts from the start of the track
};

}  // namespace clamor
