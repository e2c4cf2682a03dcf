#include "tools/experiments/motion_scene.h"

#include <algorithm>
#include <cmath>

#include "common/bounds.h"
#include "common/random.h"
#include "tools/experiments/track.h"

namespace clamor {

namespace {

AuralizerInput rolled(AuralizerInput input, std::uint64_t roll) {
  for (Signal& signal : input.signals) signal.loop = true;
  for (TimedEnvelope& envelope : input.envelopes) envelope.loop = true;
  if (roll == 0) return input;
  input.emitters = with_other_phases(std::move(input.emitters), roll);
  for (std::size_t s = 0; s < input.sources.size(); ++s) {
    const auto use = static_cast<std::uint32_t>(Use::kPolarity);
    const RandomBits bits = philox(roll, {static_cast<std::uint32_t>(s), 0, 0, use});
    if (!input.sources[s].is_emitter) input.sources[s].polarity = bits[0] % 2 == 0 ? 1 : -1;
  }
  return input;
}

}  // namespace

ListenerPath::ListenerPath(const std::vector<Source>& sources, const Vec3& start) : start_(start) {
  const auto [low, high] =
      bounds_of(sources, [](const Source& source) { return Vec3(source.position_m); });
  const Vec3 room = glm::min(high - start, start - low);
  const double half_m = std::clamp(0.6 * std::min(room.x, room.z), 0.5, 40.0);
  large_m_ = 0.7 * half_m;
  small_m_ = 0.3 * half_m;
}

Listener ListenerPath::at(double distance_m) const {
  const double turn = distance_m / (large_m_ + small_m_);
  const Vec3 place = start_ + large_m_ * Vec3(1 - std::cos(turn), 0, std::sin(turn)) -
                     Vec3(large_m_, 0, 0) +
                     small_m_ * Vec3(std::cos(0.37 * turn), 0, std::sin(0.37 * turn));
  return {place, -turn, 0};
}

MotionScene::MotionScene(const AuralizerInput& input, std::uint64_t roll)
    : ExperimentScene(rolled(input, roll), EnvelopeSmoothing{}),
      moments_(signal_weights_of(this->input(), {0, 0, 0})) {}

double MotionScene::power(const Keyframe& keyframe, double time_s) const {
  double power = 0;
  for (const Voice& voice : keyframe.voices) {
    for (std::size_t e = 0; e < kEars; ++e) {
      const double plays_s = time_s - voice.delay_frames[e] / kSampleRate_hz;
      const Bands& counts = moments_.steady() ? moments_.by_signal[voice.signal]
                                              : moments_.tracks[voice.signal].at(plays_s).weights;
      const Bands& gain = voice.gain[e];
      float sum = 0;
      for (std::size_t b = 0; b < kBandCount; ++b) sum += counts[b] * gain[b] * gain[b];
      power += static_cast<double>(sum);
    }
  }
  return power;
}

RenderedSegment render_segment(const MotionScene& scene, const ListenerPath& path, double speed_mps,
                               const std::string& strategy, std::size_t voices,
                               std::uint64_t first_keyframe, std::size_t keyframes) {
  // Voices of all sources need only the slopes of their delays: two keyframes.
  const std::uint64_t lead = std::min<std::uint64_t>(first_keyframe, strategy == "all" ? 3 : 10);
  const SeededSampler sampler = scene.sampler(strategy, voices);
  Track track(
      scene.radiation(), scene.signals(), *sampler.sampler,
      [&](double time_s) { return path.at(speed_mps * time_s); }, first_keyframe - lead);
  RenderedSegment segment{{{{}, {}}, kSampleRate_hz, {}}, {}};
  for (std::uint64_t k = 0; k < lead; ++k) track.next(segment.sound);
  for (auto& channel : segment.sound.channels) channel.clear();
  for (std::size_t k = 0; k < keyframes; ++k) {
    const Keyframe& keyframe = track.next(segment.sound);
    segment.powers.push_back(scene.power(keyframe, track.time_s()));
  }
  return segment;
}

}  // namespace clamor
