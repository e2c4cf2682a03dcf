#include "tools/strategies/strategies.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>

#include "common/text.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/sampling/moving_source_list.h"
#include "tools/strategies/all_sampler.h"
#include "tools/strategies/representative_octree.h"

namespace clamor {

namespace {

// Sections 3.3 to 3.5: the candidates are all sources of the list or a cut through the octree, and
// dynamic sampling (3.4) chooses among them by what they send towards the listener. Factors are
// multiplied.
class PaperSampler final : public Sampler {
 public:
  // Without a rule, all candidates are chosen.
  PaperSampler(const StrategyOptions& options, const RadiationModel& radiation,
               const SignalWeights& weights, const SourceList& list,
               std::optional<DynamicSample::Rule> rule)
      : options_(options), radiation_(radiation), weights_(weights), page_(list.page()) {
    if (rule) dynamic_.emplace(*rule, options.voices, options.tuning);
    stays_ = rule == DynamicSample::Rule::kOnce;
    if (options.strategy.starts_with("octree")) {
      tree_.emplace(make_tree());
      cut_size_ = options.voices *
                  (rule ? static_cast<std::size_t>(options.tuning.candidates_per_voice) : 1);
    } else {
      for (std::uint32_t i = 0; i < page_.size(); ++i) cut_.push_back({i, 1});
    }
  }

  std::span<const SampledSource> sample(const Listener& listener, double /*time_s*/) override {
    const Vec3& place = listener.position_m;
    if (place_ && stays_) return sample_;
    if (place_ != place || faced_ != reception()) find_candidates(place);
    sample_.clear();
    if (!dynamic_)
      for (const auto& [point, factor] : cut_) add(point, factor);
    else
      for (const DynamicSample::Choice& chosen : dynamic_->next(candidates_))
        add(cut_[chosen.candidate].point, cut_[chosen.candidate].factor * chosen.factor);
    return sample_;
  }
  bool complete() override { return true; }
  std::size_t capacity() const override { return std::min(options_.voices, page_.size()); }

 private:
  bool amplitudes() const { return options_.estimator == Estimator::kAmplitude; }

  void find_candidates(const Vec3& place) {
    place_ = place;
    faced_ = reception();
    if (tree_) cut_ = tree_->cut(place, cut_size_, reception());
    candidates_.clear();
    for (const auto& [point, factor] : cut_) candidates_.push_back({point, factor});
    if (dynamic_ && options_.strategy != "random") weigh(place);
  }

  // Multiplies the weight of each candidate by that of its source.
  void weigh(const Vec3& place) {
    constexpr std::size_t kTogether = 64;
    std::array<const Source*, kTogether> sources;
    std::array<ReceivedIntensity, kTogether> received;
    for (std::size_t first = 0; first < candidates_.size(); first += kTogether) {
      const std::size_t count = std::min(kTogether, candidates_.size() - first);
      for (std::size_t i = 0; i < count; ++i) sources[i] = &page_[candidates_[first + i].number];
      radiation_.receive(std::span(sources).first(count), place, received.data());
      for (std::size_t i = 0; i < count; ++i) {
        const Source& source = *sources[i];
        const Bands intensity = apply_reception(reception(), source, place, received[i].intensity);
        const double power = weighted_sum(weights_.by_signal[radiation_.signal(source)], intensity);
        candidates_[first + i].weight *= amplitudes() ? std::sqrt(power) : power;
      }
    }
  }

  void add(std::size_t source, double factor) {
    sample_.push_back({source, amplitudes() ? factor * factor : factor, &page_[source],
                       radiation_.signal(page_[source])});
  }

  // The tree of section 3.5. A source's volume is its radiation in all directions.
  RepresentativeOctree make_tree() const {
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
  std::optional<RepresentativeOctree> tree_;  // none: the whole list
  std::optional<DynamicSample> dynamic_;
  bool stays_ = false;        // the first sample does
  std::size_t cut_size_ = 0;  // nodes
  std::vector<RepresentativeOctree::Representative> cut_;
  std::vector<DynamicSample::Candidate> candidates_;  // those of cut_
  std::optional<Vec3> place_;                         // of the candidates
  Reception faced_;                                   // likewise
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
  const auto of_paper = [&](std::optional<Rule> rule) -> std::unique_ptr<Sampler> {
    return std::make_unique<PaperSampler>(options, radiation, weights, list, rule);
  };
  if (name == "all") return make_all_sampler(radiation, list, occlusion, moving);
  if (name == "random" || name == "importance") return of_paper(Rule::kOnce);
  if (name == "full-resampling") return of_paper(Rule::kFull);
  if (name == "stochastic-diffusion") return of_paper(Rule::kStochastic);
  if (name == "adaptive-diffusion" || name == "octree-diffusion") return of_paper(Rule::kAdaptive);
  if (name == "octree") return of_paper(std::nullopt);
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
