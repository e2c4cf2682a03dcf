#include "tools/experiments/motion_scene.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/bounds.h"
#include "common/random.h"
#include "runtime/engine/auralizer_input.h"
#include "tools/strategies/all_sampler.h"

namespace clamor {

namespace {

AuralizerInput rolled(AuralizerInput input, std::uint64_t roll) {
  for (Signal& signal : input.signals) signal.loop = true;
  for (TimedEnvelope& envelope : input.envelopes) envelope.loop = true;
  if (roll == 0) return input;
  double longest_s = 0;
  for (const Emitter& emitter : input.emitters) longest_s = std::max(longest_s, emitter.delay_s);
  for (std::size_t e = 0; e < input.emitters.size(); ++e) {
    const auto use = static_cast<std::uint32_t>(Use::kPhase);
    const RandomBits bits = philox(roll, {static_cast<std::uint32_t>(e), 0, 0, use});
    input.emitters[e].delay_s = longest_s * unit(bits[0]);
  }
  for (std::size_t s = 0; s < input.sources.size(); ++s) {
    const auto use = static_cast<std::uint32_t>(Use::kPolarity);
    const RandomBits bits = philox(roll, {static_cast<std::uint32_t>(s), 0, 0, use});
    if (!input.sources[s].is_emitter) input.sources[s].polarity = bits[0] % 2 == 0 ? 1 : -1;
  }
  return input;
}

SignalWeights weights_of(const AuralizerInput& input, const EnvelopeSmoothing& smoothing) {
  std::vector<TimedEnvelope> envelopes;
  for (const Signal& signal : input.signals)
    envelopes.push_back({SignalEnvelope(signal), signal.samples.size(), signal.loop});
  return make_signal_weights(envelopes, smoothing);
}

std::size_t slots_for(const std::string& strategy, const Sampler& sampler) {
  return strategy == "all" ? sampler.capacity() : 3 * sampler.capacity();
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

MotionScene::MotionScene(AuralizerInput input, std::uint64_t roll)
    : input_(rolled(std::move(input), roll)),
      signals_(prepare_signals(input_.signals)),
      radiation_(input_.emitters, input_.materials, input_.air,
                 LateBoost(input_.decay, input_.sources.size())),
      weights_(weights_of(input_, {})),
      moments_(weights_of(input_, {0, 0, 0})),
      list_(std::make_shared<SourceList>(radiation_, weights_, input_.sources)) {}

std::unique_ptr<Sampler> MotionScene::sampler(const std::string& strategy,
                                              std::size_t voices) const {
  if (strategy == "all") return make_all_sampler(radiation_, *list_);
  return make_priority_sampler(radiation_, weights_, *list_, voices);
}

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

MotionTrack::MotionTrack(const MotionScene& scene, const ListenerPath& path, double speed_mps,
                         const std::string& strategy, std::size_t voices,
                         std::uint64_t first_keyframe)
    : scene_(scene),
      path_(path),
      speed_mps_(speed_mps),
      sampler_(scene.sampler(strategy, voices)),
      maker_(scene.radiation(), slots_for(strategy, *sampler_)),
      mixer_(scene.signals(), slots_for(strategy, *sampler_)),
      number_(first_keyframe) {
  keyframe_.voices.reserve(slots_for(strategy, *sampler_));
  make_keyframe();
  mixer_.begin(keyframe_, static_cast<std::int64_t>(first_keyframe) * kKeyframeFrames);
}

void MotionTrack::make_keyframe() {
  const Listener listener = motion_.next(path_.at(speed_mps_ * time_s()));
  maker_.make(sampler_->sample(listener, time_s()), listener, keyframe_);
}

void MotionTrack::next(Sound& sound, std::vector<double>& powers) {
  ++number_;
  make_keyframe();
  powers.push_back(scene_.power(keyframe_, time_s()));
  mixer_.load(keyframe_);
  std::array<float, kEars * kMaxFrames> mixed;
  for (int done = 0; done < kKeyframeFrames;) {
    const int steps = mixer_.steps_left();
    mixer_.mix(mixed.data(), steps);
    for (std::size_t f = 0; f < static_cast<std::size_t>(steps) * kStepFrames; ++f)
      for (std::size_t e = 0; e < kEars; ++e) sound.channels[e].push_back(mixed[f * kEars + e]);
    done += steps * kStepFrames;
  }
}

RenderedSegment render_segment(const MotionScene& scene, const ListenerPath& path, double speed_mps,
                               const std::string& strategy, std::size_t voices,
                               std::uint64_t first_keyframe, std::size_t keyframes) {
  // Voices of all sources need only the slopes of their delays: two keyframes.
  const std::uint64_t lead = std::min<std::uint64_t>(first_keyframe, strategy == "all" ? 3 : 10);
  MotionTrack track(scene, path, speed_mps, strategy, voices, first_keyframe - lead);
  RenderedSegment stretch{{{{}, {}}, kSampleRate_hz}, {}};
  for (std::uint64_t k = 0; k < lead; ++k) track.next(stretch.sound, stretch.powers);
  stretch = {{{{}, {}}, kSampleRate_hz}, {}};
  for (std::size_t k = 0; k < keyframes; ++k) track.next(stretch.sound, stretch.powers);
  return stretch;
}

}  // namespace clamor
