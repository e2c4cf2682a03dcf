// experiment_scene.h: a bake in memory, to be sampled and rendered repeatedly with different seeds.
//
// Threads: immutable after construction; any thread may use it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/audio/audio_file.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/sampling/sampler.h"
#include "runtime/streaming/prepared_signal.h"
#include "tools/strategies/strategies.h"

namespace clamor {

// A sampler and the list that it samples from.
struct SeededSampler {
  std::shared_ptr<SourceList> list;
  std::unique_ptr<Sampler> sampler;

  std::span<const SampledSource> sample(const Listener& listener) {
    return sampler->sample(listener);
  }
};

class ExperimentScene {
 public:
  // Signals weigh as they do on average, or with `smoothing` as they do at each time.
  explicit ExperimentScene(AuralizerInput input,
                           const std::optional<EnvelopeSmoothing>& smoothing = std::nullopt);
  ExperimentScene(const ExperimentScene&) = delete;
  ExperimentScene& operator=(const ExperimentScene&) = delete;

  // Opens a bake. If it has more than `max_sources` sources (0: no limit), keeps every n-th of
  // them, at unchanged power, so that about `max_sources` remain.
  static Result<std::unique_ptr<ExperimentScene>> open(const std::string& path,
                                                       std::size_t max_sources);

  const AuralizerInput& input() const { return input_; }
  const RadiationModel& radiation() const { return radiation_; }
  const std::vector<PreparedSignal>& signals() const { return signals_; }
  std::size_t size() const { return input_.sources.size(); }

  // The paper's strategies use `seed`. For priority, seed 1 keeps the numbers u of the bake, and
  // any other seed draws new ones.
  SeededSampler sampler(const std::string& strategy, std::size_t voices,
                        Estimator estimator = Estimator::kPower, std::uint64_t seed = 1) const;

  // Weight of each source at a place: its loudness-weighted received power.
  std::vector<double> powers(const Vec3& place) const;

  // Mean square of the signal of a source, per band.
  const Bands& mean_square(const Source& source) const {
    return signals_[radiation_.signal(source)].mean_square();
  }

  // Renders both ears of a listener who stands still. `phases` other than 0 draws other start times
  // for the emitters' loops, within the range of their delays.
  Sound render(Sampler& sampler, const Vec3& place, double seconds, std::uint64_t phases = 0) const;

  // Default listener position: amid many emitters, or 4 m in front of a single one.
  Vec3 default_listener_m() const;

 private:
  AuralizerInput input_;
  std::vector<PreparedSignal> signals_;
  RadiationModel radiation_;
  SignalWeights weights_;
  std::shared_ptr<SourceList> list_;
};

// The emitters with other start times, within the range of their delays.
std::vector<Emitter> with_other_phases(std::vector<Emitter> emitters, std::uint64_t seed);

// Weights of the signals over time.
SignalWeights signal_weights_of(const AuralizerInput& input, const EnvelopeSmoothing& smoothing);

// Calls work(0 ... count - 1) on all cores, in any order.
void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work);

// Sums over both ears.
double inner_product(const Sound& a, const Sound& b);
inline double energy(const Sound& sound) { return inner_product(sound, sound); }

}  // namespace clamor
