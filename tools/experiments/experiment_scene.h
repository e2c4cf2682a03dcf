// experiment_scene.h: a bake in memory, to be sampled and rendered over and over with other seeds.
//
// Immutable once made; any thread may use it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/level/level.h"
#include "formats/level/walk_file.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/sampling/strategies.h"
#include "runtime/streaming/prepared_signal.h"

namespace clamor {

// A sampler, and the list that it samples from.
struct SeededSampler {
  std::shared_ptr<SourceList> list;
  std::unique_ptr<Sampler> sampler;

  std::span<const SampledSource> sample(const Listener& listener) {
    return sampler->sample(listener);
  }
};

class ExperimentScene {
 public:
  explicit ExperimentScene(AuralizerInput input);

  // The whole bake; or, of one with more sources, every so-manieth such that about `most` are left
  // (0: all), at their own loudness. The Error is the file's.
  static Result<std::unique_ptr<ExperimentScene>> open(const std::string& path, std::size_t most);

  const AuralizerInput& input() const { return input_; }
  const RadiationModel& field() const { return field_; }
  std::size_t size() const { return input_.sources.size(); }

  // The paper's strategies draw by `seed`; for priority, 1 means the numbers u of the bake, and any
  // other seed new ones.
  SeededSampler sampler(const std::string& strategy, std::size_t voices, Estimator estimator,
                        std::uint64_t seed) const;

  // Loudness-weighted power of each source at a place: what the sampler calls its weight.
  std::vector<double> powers(const Vec3& place) const;
  double power(const Source& source, const Vec3& place) const {
    return weight(field_, weights_.by_signal[field_.signal(source)], source, place);
  }

  // Mean square of what a source plays, per band.
  const Bands& mean_square(const Source& source) const {
    return signals_[field_.signal(source)].mean_square();
  }

  // What both ears hear; `phases` other than 0 start the emitters' loops at other moments, within
  // the span of delays that they have.
  Sound render(Sampler& sampler, const Walk& walk, double seconds, std::uint64_t phases = 0) const;

  // A place to listen at that suits most scenes: amid many emitters, 4 m before a single one.
  Vec3 default_listener_m() const;

 private:
  AuralizerInput input_;
  std::vector<PreparedSignal> signals_;
  RadiationModel field_;
  SignalWeights weights_;
  std::shared_ptr<SourceList> list_;
};

// The level that a bake file was made of, to be baked again with other materials.
class BakedLevel {
 public:
  static Result<BakedLevel> open(const std::string& path);

  // All surfaces reflect by Phong lobes of these exponents, without scattering; 0 is diffuse.
  void set_phong(const Bands& exponents);

  // All emitters play a single impulse, once.
  void set_impulse();

  // Keeping about so many reflections. The same bytes each time.
  Result<std::unique_ptr<ExperimentScene>> rebake(std::uint64_t sources) const;

 private:
  Level level_;
  BakeSettings settings_;
};

// Calls work(0 ... count - 1) on all cores, in no order.
void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work);

// Of both ears.
double energy(const Sound& sound);
double inner_product(const Sound& a, const Sound& b);

}  // namespace clamor
