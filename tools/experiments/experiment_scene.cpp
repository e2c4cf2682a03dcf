#include "tools/experiments/experiment_scene.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <thread>

#include "common/random.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/sampling_pipeline.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/mixing/mixer.h"

namespace clamor {

ExperimentScene::ExperimentScene(AuralizerInput input)
    : input_(std::move(input)),
      signals_(prepare_signals(input_.signals)),
      radiation_(input_.emitters, input_.materials, input_.air,
                 LateBoost(input_.decay, input_.sources.size())),
      weights_(mean_weights(signals_)),
      list_(std::make_shared<SourceList>(radiation_, weights_, input_.sources)) {}

Result<std::unique_ptr<ExperimentScene>> ExperimentScene::open(const std::string& path,
                                                               std::size_t max_sources) {
  auto file = BakeFile::open(path, FileAccess::kMap);
  if (!file.ok()) return file.error();
  auto input = read_auralizer_input(*file);
  if (!input.ok()) return input.error();
  input->origin_m = Vec3(0);
  if (const auto right = check(*input); !right.ok()) return right.error().in(path);
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
  for (const Source& source : input_.sources) powers.push_back(power(source, place));
  return powers;
}

Sound ExperimentScene::render(Sampler& sampler, const Walk& walk, double seconds,
                              std::uint64_t phases) const {
  std::vector<Emitter> emitters = input_.emitters;
  if (phases != 0) {
    double longest_s = 0;
    for (const Emitter& emitter : emitters) longest_s = std::max(longest_s, emitter.delay_s);
    for (std::size_t e = 0; e < emitters.size(); ++e) {
      const auto use = static_cast<std::uint32_t>(Use::kPhase);
      const RandomBits bits = philox(phases, {static_cast<std::uint32_t>(e), 0, 0, use});
      emitters[e].delay_s = longest_s * unit(bits[0]);
    }
  }
  const RadiationModel radiation(emitters, input_.materials, input_.air,
                                 LateBoost(input_.decay, input_.sources.size()));
  const std::size_t slots = 3 * sampler.capacity();
  KeyframeMaker maker(radiation, slots);
  Keyframe keyframe;
  keyframe.voices.reserve(slots);
  ListenerMotion motion(kKeyframe_s);
  const auto make = [&] {
    const double time_s = static_cast<double>(keyframe.number) * kKeyframeFrames / kSampleRate_hz;
    const Listener listener = motion.next(walk.at(time_s));
    maker.make(sampler.sample(listener), listener, keyframe);
  };

  const auto frames = static_cast<std::size_t>(std::llround(seconds * kSampleRate_hz));
  Sound sound{{std::vector<float>(frames), std::vector<float>(frames)}, kSampleRate_hz, {}};
  Mixer mixer(signals_, slots);
  make();
  mixer.begin(keyframe, 0);
  std::array<float, kEars * kMaxFrames> mixed;
  for (std::size_t done = 0; done < frames;) {
    if (mixer.wants_keyframe()) {
      ++keyframe.number;
      make();
      mixer.load(keyframe);
    }
    const int steps = mixer.steps_left();
    mixer.mix(mixed.data(), steps);
    const auto count = std::min(frames - done, static_cast<std::size_t>(steps) * kStepFrames);
    for (std::size_t f = 0; f < count; ++f)
      for (std::size_t ear = 0; ear < kEars; ++ear)
        sound.channels[ear][done + f] = mixed[f * kEars + ear];
    done += count;
  }
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

void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next = 0;
  const auto take = [&] {
    for (std::size_t i; (i = next.fetch_add(1)) < count;) work(i);
  };
  std::vector<std::jthread> others;
  for (unsigned core = 1; core < std::thread::hardware_concurrency(); ++core)
    others.emplace_back(take);
  take();
}

double inner_product(const Sound& a, const Sound& b) {
  double sum = 0;
  for (std::size_t c = 0; c < a.channels.size(); ++c)
    for (std::size_t i = 0; i < a.channels[c].size(); ++i)
      sum += static_cast<double>(a.channels[c][i]) * b.channels[c][i];
  return sum;
}

double energy(const Sound& sound) { return inner_product(sound, sound); }

}  // namespace clamor
