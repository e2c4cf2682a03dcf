#include "tools/experiments/experiment_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/parallel_for.h"
#include "common/random.h"
#include "formats/bake_file/bake_file.h"
#include "tools/experiments/track.h"

namespace clamor {

ExperimentScene::ExperimentScene(AuralizerInput input,
                                 const std::optional<EnvelopeSmoothing>& smoothing)
    : input_(std::move(input)),
      signals_(prepare_signals(input_.signals)),
      radiation_(input_.emitters, input_.materials, input_.air,
                 LateBoost(input_.decay, input_.sources.size())),
      weights_(smoothing ? signal_weights_of(input_, *smoothing) : mean_weights(signals_)),
      list_(std::make_shared<SourceList>(radiation_, weights_, input_.sources)) {}

Result<std::unique_ptr<ExperimentScene>> ExperimentScene::open(const std::string& path,
                                                               std::size_t max_sources) {
  auto file = BakeFile::open(path, FileAccess::kMap);
  if (!file.ok()) return file.error();
  auto input = read_auralizer_input(*file);
  if (!input.ok()) return input.error();
  input->origin_m = Vec3(0);
  if (const auto right = check(*input); !right.ok()) return right.error().in(path);
  if (input->emitters.empty()) return Error(path + ": it has no emitters; bake it with one");
  if (max_sources > 0 && input->sources.size() > max_sources) {
    const std::size_t every = (input->sources.size() + max_sources - 1) / max_sources;
    std::vector<Source> few;
    for (std::size_t i = 0; i < input->sources.size(); i += every) few.push_back(input->sources[i]);
    input->sources = std::move(few);
  }
  return std::make_unique<ExperimentScene>(std::move(*input));
}

SeededSampler ExperimentScene::sampler(const std::string& strategy, std::size_t voices,
                                       Estimator estimator, std::uint64_t seed) const {
  SeededSampler result{list_, nullptr};
  if (strategy == "priority" && seed != 1) {
    std::vector<Source> sources = input_.sources;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      const auto use = static_cast<std::uint32_t>(Use::kPolarity);
      const RandomBits bits = philox(seed, {static_cast<std::uint32_t>(i), 0, 0, use});
      sources[i].u = static_cast<float>(unit_above_zero(bits[0]));
    }
    result.list = std::make_shared<SourceList>(radiation_, weights_, std::move(sources));
  }
  StrategyOptions options{strategy, voices, estimator, {}};
  options.tuning.seed = seed;
  result.sampler = make_sampler(options, radiation_, weights_, *result.list);
  return result;
}

std::vector<double> ExperimentScene::powers(const Vec3& place) const {
  std::vector<double> powers;
  powers.reserve(size());
  for (const Source& source : input_.sources)
    powers.push_back(
        weight(radiation_, weights_.by_signal[radiation_.signal(source)], source, place));
  return powers;
}

Sound ExperimentScene::render(Sampler& sampler, const Vec3& place, double seconds,
                              std::uint64_t phases) const {
  const RadiationModel radiation(
      phases == 0 ? input_.emitters : with_other_phases(input_.emitters, phases), input_.materials,
      input_.air, LateBoost(input_.decay, input_.sources.size()));
  Track track(radiation, signals_, sampler, [&](double) { return Listener{place, 0, 0}; });
  Sound sound{{{}, {}}, kSampleRate_hz, {}};
  const auto frames = static_cast<std::size_t>(std::llround(seconds * kSampleRate_hz));
  while (sound.frames() < frames) track.next(sound);
  for (auto& channel : sound.channels) channel.resize(frames);
  return sound;
}

Vec3 ExperimentScene::default_listener_m() const {
  const auto& emitters = input_.emitters;
  if (emitters.size() == 1) return emitters[0].position_m + 4.0 * emitters[0].axis;
  Vec3 sum(0);
  double lowest_m = emitters[0].position_m.y;
  for (const Emitter& emitter : emitters) {
    sum += emitter.position_m;
    lowest_m = std::min(lowest_m, emitter.position_m.y);
  }
  sum /= static_cast<double>(emitters.size());
  return {sum.x, lowest_m, sum.z};
}

std::vector<Emitter> with_other_phases(std::vector<Emitter> emitters, std::uint64_t seed) {
  double longest_s = 0;
  for (const Emitter& emitter : emitters) longest_s = std::max(longest_s, emitter.delay_s);
  for (std::size_t e = 0; e < emitters.size(); ++e) {
    const auto use = static_cast<std::uint32_t>(Use::kPhase);
    const RandomBits bits = philox(seed, {static_cast<std::uint32_t>(e), 0, 0, use});
    emitters[e].delay_s = longest_s * unit(bits[0]);
  }
  return emitters;
}

SignalWeights signal_weights_of(const AuralizerInput& input, const EnvelopeSmoothing& smoothing) {
  std::vector<TimedEnvelope> envelopes;
  for (const Signal& signal : input.signals)
    envelopes.push_back({SignalEnvelope(signal), signal.samples.size(), signal.loop});
  return make_signal_weights(envelopes, smoothing);
}

void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) {
  parallel_for(count, 1, 0, [&](std::size_t i, std::size_t) { work(i); });
}

double inner_product(const Sound& a, const Sound& b) {
  double sum = 0;
  for (std::size_t c = 0; c < a.channels.size(); ++c)
    for (std::size_t i = 0; i < a.channels[c].size(); ++i)
      sum += static_cast<double>(a.channels[c][i]) * b.channels[c][i];
  return sum;
}

}  // namespace clamor
