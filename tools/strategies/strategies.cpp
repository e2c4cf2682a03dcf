#include "tools/strategies/strategies.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>

#include "common/text.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/sampling/moving_source_list.h"
#include "tools/strategies/all_sampler.h"
#include "tools/strategies/representative_octree.h"

namespace clamor {

namespace {

// Base of the samplers below: a list, and the weights of its sources.
class Listed : public Sampler {
 public:
  Listed(const StrategyOptions& options, const RadiationModel& radiation,
         const SignalWeights& weights, const SourceList& list)
      : options_(options), radiation_(radiation), weights_(weights), page_(list.page()) {}

  bool complete() override { return true; }
  std::size_t capacity() const override { return std::min(options_.voices, page_.size()); }

 protected:
  bool amplitudes() const { return options_.estimator == Estimator::kAmplitude; }

  // True at first, and when the listener has moved or turned since the last time.
  bool is_elsewhere(const Vec3& place) {
    const bool stays = place_ == place && faced_ == reception();
    place_ = place;
    faced_ = reception();
    return !stays;
  }

  // Multiplies the weight of each candidate by that of its source.
  void weigh(std::vector<DynamicSample::Candidate>& candidates, const Vec3& place) const {
    constexpr std::size_t kTogether = 64;
    std::array<const Source*, kTogether> sources;
    std::array<ReceivedIntensity, kTogether> received;
    for (std::size_t first = 0; first < candidates.size(); first += kTogether) {
      const std::size_t count = std::min(kTogether, candidates.size() - first);
      for (std::size_t i = 0; i < count; ++i) sources[i] = &page_[candidates[first + i].number];
      radiation_.receive(std::span(sources).first(count), place, received.data());
      for (std::size_t i = 0; i < count; ++i) {
        const Source& source = *sources[i];
        const Bands intensity = apply_reception(reception(), source, place, received[i].intensity);
        const double power = weighted_sum(weights_.by_signal[radiation_.signal(source)], intensity);
        candidates[first + i].weight *= amplitudes() ? std::sqrt(power) : power;
      }
    }
  }

  SampledSource scaled(std::size_t source, double factor) const {
    return {source, amplitudes() ? factor * factor : factor, &page_[source],
            radiation_.signal(page_[source])};
  }

  // The tree of section 3.5. A source's volume is its radiation in all directions.
  RepresentativeOctree representatives() const {
    std::vector<RepresentativeOctree::Point> points;
    for (std::size_t i = 0; i < page_.size(); ++i) {
      const Source& source = page_[i];
      const Bands& by_band = weights_.by_signal[radiation_.signal(source)];
      double power = 0;
      for (std::size_t b = 0; b < kBandCount; ++b)
        power += static_cast<double>(by_band[b]) * source.power[b];
      points.push_back({Vec3(source.position_m), amplitudes() ? std::sqrt(power) : power,
                        source_radius_m(source)});
    }
    return {points, amplitudes() ? 1.0 : 2.0, options_.tuning.seed};
  }

  const StrategyOptions options_;
  const RadiationModel& radiation_;
  const SignalWeights& weights_;
  const SourcePage& page_;

 private:
  std::optional<Vec3> place_;
  Reception faced_;
};

// Sections 3.3 and 3.4: from the whole list.
class FromList final : public Listed {
 public:
  FromList(const StrategyOptions& options, const RadiationModel& radiation,
           const SignalWeights& weights, const SourceList& list, DynamicSample::Rule rule)
      : Listed(options, radiation, weights, list),
        once_(rule == DynamicSample::Rule::kOnce),
        even_(options.strategy == "random"),
        dynamic_(rule, options.voices, options.tuning) {
    for (std::size_t i = 0; i < page_.size(); ++i) candidates_.push_back({i, 1});
  }

  std::span<const SampledSource> sample(const Listener& listener, double /*time_s*/) override {
    const Vec3& place = listener.position_m;
    if (begun_ && once_) return sample_;
    begun_ = true;
    if (!even_ && is_elsewhere(place)) {
      for (DynamicSample::Candidate& candidate : candidates_) candidate.weight = 1;
      weigh(candidates_, place);
    }
    sample_.clear();
    for (const DynamicSample::Choice& chosen : dynamic_.next(candidates_))
      sample_.push_back(scaled(chosen.candidate, chosen.factor));
    return sample_;
  }

 private:
  const bool once_, even_;
  bool begun_ = false;
  DynamicSample dynamic_;
  std::vector<DynamicSample::Candidate> candidates_;
  std::vector<SampledSource> sample_;
};

// Section 3.5: the cut alone.
class OctreeCut final : public Listed {
 public:
  OctreeCut(const StrategyOptions& options, const RadiationModel& radiation,
            const SignalWeights& weights, const SourceList& list)
      : Listed(options, radiation, weights, list), tree_(representatives()) {}

  std::span<const SampledSource> sample(const Listener& listener, double /*time_s*/) override {
    const Vec3& place = listener.position_m;
    if (!is_elsewhere(place)) return sample_;
    sample_.clear();
    for (const auto& representative : tree_.cut(place, options_.voices, reception()))
      sample_.push_back(scaled(representative.point, representative.factor));
    return sample_;
  }

 private:
  const RepresentativeOctree tree_;
  std::vector<SampledSource> sample_;
};

// Section 3.5, at its end: a larger cut gives the candidates, and dynamic sampling (3.4) weights
// them by what they send towards the listener. Factors are multiplied.
class OctreeDiffusion final : public Listed {
 public:
  OctreeDiffusion(const StrategyOptions& options, const RadiationModel& radiation,
                  const SignalWeights& weights, const SourceList& list)
      : Listed(options, radiation, weights, list),
        tree_(representatives()),
        dynamic_(DynamicSample::Rule::kAdaptive, options.voices, options.tuning) {}

  std::span<const SampledSource> sample(const Listener& listener, double /*time_s*/) override {
    const Vec3& place = listener.position_m;
    if (is_elsewhere(place)) {
      cut_ = tree_.cut(
          place, options_.voices * static_cast<std::size_t>(options_.tuning.candidates_per_voice),
          reception());
      candidates_.clear();
      for (const auto& [point, factor] : cut_) candidates_.push_back({point, factor});
      weigh(candidates_, place);
    }
    sample_.clear();
    for (const DynamicSample::Choice& chosen : dynamic_.next(candidates_)) {
      const auto& [point, factor] = cut_[chosen.candidate];
      sample_.push_back(scaled(point, factor * chosen.factor));
    }
    return sample_;
  }

 private:
  const RepresentativeOctree tree_;
  DynamicSample dynamic_;
  std::vector<RepresentativeOctree::Representative> cut_;
  std::vector<DynamicSample::Candidate> candidates_;
  std::vector<SampledSource> sample_;
};

// A sampler with factors for powers, applied to amplitudes.
class OnAmplitudes final : public Sampler {
 public:
  explicit OnAmplitudes(std::unique_ptr<Sampler> sampler) : sampler_(std::move(sampler)) {}

  std::span<const SampledSource> sample(const Listener& listener, double /*time_s*/) override {
    sampler_->set_reception(reception());
    const auto sample = sampler_->sample(listener);
    sample_.assign(sample.begin(), sample.end());
    for (SampledSource& chosen : sample_) chosen.power_scale *= chosen.power_scale;
    return sample_;
  }
  bool complete() override { return sampler_->complete(); }
  std::size_t capacity() const override { return sampler_->capacity(); }
  void set_voice_count(std::size_t voices) override { sampler_->set_voice_count(voices); }
  void stop_when(const std::atomic<bool>* stop) override { sampler_->stop_when(stop); }
  std::uint64_t work() const override { return sampler_->work(); }
  std::uint64_t bounded_keyframes() const override { return sampler_->bounded_keyframes(); }

 private:
  const std::unique_ptr<Sampler> sampler_;
  std::vector<SampledSource> sample_;
};

class NamedStrategy final : public SamplingStrategy {
 public:
  explicit NamedStrategy(const StrategyOptions& options) : options_(options) {}

  std::string name() const override { return options_.strategy; }
  bool needs_list() const override { return clamor::needs_list(options_.strategy); }
  bool takes_moving_sources() const override { return takes_moving(options_.strategy); }
  bool uses_occlusion() const override { return clamor::uses_occlusion(options_.strategy); }

  std::unique_ptr<Sampler> make_sampler(const SamplerInput& input) const override {
    StrategyOptions options = options_;
    options.voices = input.voices;
    options.bound = input.bound;
    if (needs_list())
      return clamor::make_sampler(options, input.radiation, input.weights, *input.list,
                                  input.occlusion, input.moving);
    return clamor::make_sampler(options, input.radiation, input.weights, input.pool,
                                input.occlusion);
  }

 private:
  const StrategyOptions options_;
};

}  // namespace

Result<void> check(const StrategyOptions& options) {
  std::vector<std::string> names;
  std::string all;
  for (const StrategyInfo& info : kStrategies) {
    names.emplace_back(info.name);
    all += (all.empty() ? "'" : ", '") + names.back() + "'";
  }
  if (std::find(names.begin(), names.end(), options.strategy) == names.end())
    return Error("no strategy is called " + in_quotes(options.strategy) + ", the nearest is " +
                 in_quotes(nearest_name(options.strategy, names)) + "; there are " + all + ".");
  if (options.voices < 1 || options.voices > kMaxVoices)
    return Error("cannot mix " + std::to_string(options.voices) + " voices; ask for 1 to " +
                 std::to_string(kMaxVoices) + ".");
  const StrategyTuning& tuning = options.tuning;
  if (!(tuning.redraw_s >= 0.2 && tuning.redraw_s <= 3600))
    return Error(
        "a new sample must be drawn every 0.2 to 3600 seconds: faster, and nothing of it is ever "
        "heard at full level.");
  if (!(tuning.exchange_per_s >= 0 && tuning.exchange_per_s <= 5))
    return Error("the share of the sample exchanged per second must lie between 0 and 5.");
  if (!(tuning.epsilon > 1 && tuning.epsilon <= 100))
    return Error(
        "epsilon, a factor, must lie above 1, and not above 100; the paper has 1.1 to "
        "1.5.");
  if (tuning.candidates_per_voice < 1 || tuning.candidates_per_voice > 10000)
    return Error("there may be 1 to 10000 candidates per voice.");
  return {};
}

std::shared_ptr<const SamplingStrategy> make_strategy(const StrategyOptions& options) {
  assert(check(options).ok());
  return std::make_shared<const NamedStrategy>(options);
}

std::shared_ptr<const SamplingStrategy> make_strategy(const std::string& name) {
  return make_strategy(StrategyOptions{.strategy = name});
}

std::unique_ptr<Sampler> make_sampler(const StrategyOptions& options,
                                      const RadiationModel& radiation, const SignalWeights& weights,
                                      SourceList& list, VisibilityCache* occlusion,
                                      MovingSourceList* moving) {
  using Rule = DynamicSample::Rule;
  const std::string& name = options.strategy;
  const auto from_list = [&](Rule rule) -> std::unique_ptr<Sampler> {
    return std::make_unique<FromList>(options, radiation, weights, list, rule);
  };
  if (name == "all") return make_all_sampler(radiation, list, occlusion, moving);
  if (name == "random" || name == "importance") return from_list(Rule::kOnce);
  if (name == "full-resampling") return from_list(Rule::kFull);
  if (name == "stochastic-diffusion") return from_list(Rule::kStochastic);
  if (name == "adaptive-diffusion") return from_list(Rule::kAdaptive);
  if (name == "octree") return std::make_unique<OctreeCut>(options, radiation, weights, list);
  if (name == "octree-diffusion")
    return std::make_unique<OctreeDiffusion>(options, radiation, weights, list);
  return make_sampler(options, radiation, weights, static_cast<SourcePool&>(list), occlusion);
}

std::unique_ptr<Sampler> make_sampler(const StrategyOptions& options,
                                      const RadiationModel& radiation, const SignalWeights& weights,
                                      SourcePool& pool, VisibilityCache* occlusion) {
  assert(!needs_list(options.strategy));
  auto sampler =
      make_priority_sampler(radiation, weights, pool, options.voices, occlusion, options.bound);
  if (options.estimator == Estimator::kPower) return sampler;
  return std::make_unique<OnAmplitudes>(std::move(sampler));
}

}  // namespace clamor
