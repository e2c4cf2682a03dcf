#include "runtime/sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace clamor {

namespace {

class All final : public Sampler {
 public:
  All(const SourceField& field, const SourceList& list) {
    const SourcePage& page = list.page();
    for (std::size_t i = 0; i < page.size(); ++i)
      sample_.push_back({i, 1, &page[i], field.signal(page[i])});
  }
  std::span<const SampledSource> sample(const Vec3&, double) override { return sample_; }
  bool complete() override { return true; }
  std::size_t capacity() const override { return sample_.size(); }

 private:
  std::vector<SampledSource> sample_;
};

class Priority final : public Sampler {
 public:
  Priority(const SourceField& field, SignalWeights weights, SourcePool& pool, std::size_t voices)
      : field_(field), weights_(std::move(weights)), pool_(pool), voices_(voices) {}

  // A function of place, time and what is here alone. Where all signals are steady, one who stands
  // still costs nothing.
  std::span<const SampledSource> sample(const Vec3& place, double time_s) override {
    const bool same_moment = weights_.steady() || time_s_ == time_s;
    if (!pool_.refresh() && place_ == place && same_moment) return sample_;
    const Vec3 step_m = place_ ? place - *place_ : Vec3(0);
    place_ = place;
    time_s_ = time_s;
    pool_.begin(place, time_s);
    choose(place);
    const double tau = candidates_.size() > voices_ ? candidates_[voices_].priority : 0;
    sample_.clear();
    for (std::size_t c = 0; c < std::min(voices_, candidates_.size()); ++c) {
      const Candidate& chosen = candidates_[c];
      const Source& source = *chosen.found.source;
      double scale = std::max(1.0, tau / chosen.weight);
      if (const double kappa = pool_.unseen_key(chosen.found, place, tau); kappa > 0)
        scale =
            std::max(scale, kappa / std::accumulate(source.power.begin(), source.power.end(), 0.0));
      sample_.push_back({chosen.found.number, scale, &source, chosen.found.signal});
    }
    std::sort(sample_.begin(), sample_.end(),
              [](const auto& a, const auto& b) { return a.number < b.number; });
    pool_.ask(place + kLookAhead_keyframes * step_m, tau);
    return sample_;
  }

  bool complete() override { return pool_.complete(); }

  std::size_t capacity() const override {
    return static_cast<std::size_t>(std::min<std::uint64_t>(voices_, pool_.size()));
  }

 private:
  // The last threshold lowered by this catches k sources nearly always when a listener walks.
  static constexpr double kCaution = 0.8;
  static constexpr double kStep = 16, kNarrow = 1 + 1e-9;
  static constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();
  static constexpr double kLookAhead_keyframes = 25;  // half a second

  struct Candidate {
    double priority, weight;
    FoundSource found;
    // Ties go to the lower number, so that the choice is one.
    bool operator<(const Candidate& other) const {
      return priority != other.priority ? priority > other.priority
                                        : found.number < other.found.number;
    }
  };

  // Fills candidates_ with the k + 1 highest priorities, highest first; fewer if there are fewer.
  void choose(const Vec3& place) {
    double threshold = threshold_ > 0 ? threshold_ * kCaution : pool_.highest(place);
    // Of thresholds that were tried: the lowest with too few sources, the highest with far too
    // many.
    double too_high = std::numeric_limits<double>::infinity(), too_low = 0;
    bool unlimited = false;
    for (;;) {
      unlimited = unlimited || too_high <= too_low * kNarrow;  // that many have one priority
      const bool all = weigh_above(place, threshold, unlimited ? kNoLimit : limit());
      if (all && (candidates_.size() > voices_ || threshold == 0)) break;
      (all ? too_high : too_low) = threshold;
      if (std::isinf(too_high))
        threshold *= kStep;
      else if (too_low > 0 && !unlimited)
        threshold = std::sqrt(too_low * too_high);
      else
        threshold = threshold > std::numeric_limits<float>::min() ? threshold / kStep : 0;
    }
    if (candidates_.size() > voices_) {
      const auto last = candidates_.begin() + static_cast<std::ptrdiff_t>(voices_);
      std::nth_element(candidates_.begin(), last, candidates_.end());
      threshold_ = last->priority;
      candidates_.resize(voices_ + 1);
    } else {
      threshold_ = 0;
    }
  }

  // Looking again is cheaper than sorting out more than these. Where signals come and go, most of
  // what is found by their loudest moment is too quiet now.
  std::size_t limit() const { return (16 * voices_ + 4096) * (weights_.steady() ? 1 : 16); }

  // Every source whose priority is at least `threshold`, and above zero. False if there are more
  // than `most`, give or take those that the pool cannot tell from them.
  bool weigh_above(const Vec3& place, double threshold, std::size_t most) {
    candidates_.clear();
    found_.clear();
    if (!pool_.look(place, threshold, most, found_)) return false;
    for (const FoundSource& found : found_) {
      const Source& source = *found.source;
      const LoudnessTrack::Moment now =
          weights_now(field_, weights_, found.signal, source, place, time_s_);
      if (found.ceiling * now.share < threshold) continue;
      const double w = weight(field_, now.weights, source, place);
      const double priority = w / std::max(source.u, kLeastU);
      if (w > 0 && priority >= threshold) candidates_.push_back({priority, w, found});
    }
    return true;
  }

  const SourceField& field_;
  const SignalWeights weights_;
  SourcePool& pool_;
  const std::size_t voices_;
  double threshold_ = 0;
  std::vector<FoundSource> found_;
  std::vector<Candidate> candidates_;
  std::optional<Vec3> place_;  // of sample_
  double time_s_ = 0;
  std::vector<SampledSource> sample_;
};

}  // namespace

double weight(const SourceField& field, const Bands& of_signal, const Source& source,
              const Vec3& place) {
  const Bands intensity = field.intensity(source, place);
  double sum = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    sum += static_cast<double>(of_signal[b]) * intensity[b];
  return sum;
}

LoudnessTrack::Moment weights_now(const SourceField& field, const SignalWeights& weights,
                                  std::uint32_t signal, const Source& source, const Vec3& place,
                                  double time_s) {
  if (weights.steady()) return {weights.by_signal[signal], 1};
  return weights.tracks[signal].at(time_s - field.delay_s(source, place));
}

std::unique_ptr<Sampler> make_priority_sampler(const SourceField& field, SignalWeights weights,
                                               SourcePool& pool, std::size_t voices) {
  return std::make_unique<Priority>(field, std::move(weights), pool, voices);
}

std::unique_ptr<Sampler> make_all_sampler(const SourceField& field, const SourceList& list) {
  return std::make_unique<All>(field, list);
}

}  // namespace clamor
