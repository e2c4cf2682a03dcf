#include "runtime/sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "runtime/source_screen.h"

namespace clamor {

namespace {

class All final : public Sampler {
 public:
  explicit All(std::size_t sources) : sample_(sources) {
    for (std::size_t i = 0; i < sources; ++i) sample_[i].source = static_cast<std::uint32_t>(i);
  }
  std::span<const SampledSource> sample(const Vec3&) override { return sample_; }
  std::size_t capacity() const override { return sample_.size(); }

 private:
  std::vector<SampledSource> sample_;
};

class Priority final : public Sampler {
 public:
  Priority(const SourceField& field, SignalWeights weights, std::span<const float> u,
           std::size_t voices)
      : field_(field),
        weights_(std::move(weights)),
        u_(u.begin(), u.end()),
        voices_(voices),
        screen_(field, weights_.by_signal, u_) {}

  // A function of the place alone, so that one who stands still costs nothing.
  std::span<const SampledSource> sample(const Vec3& place) override {
    if (place_ == place) return sample_;
    place_ = place;
    choose(place);
    const double tau = candidates_.size() > voices_ ? candidates_[voices_].priority : 0;
    sample_.clear();
    for (std::size_t c = 0; c < std::min(voices_, candidates_.size()); ++c) {
      const Candidate& chosen = candidates_[c];
      sample_.push_back({chosen.source, std::max(1.0, tau / chosen.weight)});
    }
    std::sort(sample_.begin(), sample_.end(),
              [](const auto& a, const auto& b) { return a.source < b.source; });
    return sample_;
  }

  std::size_t capacity() const override { return std::min(voices_, field_.size()); }

 private:
  // The last threshold lowered by this catches k sources nearly always when a listener walks.
  static constexpr double kCaution = 0.8;

  struct Candidate {
    double priority, weight;
    std::uint32_t source;
    // Ties go to the lower number, so that the choice is one.
    bool operator<(const Candidate& other) const {
      return priority != other.priority ? priority > other.priority : source < other.source;
    }
  };

  // Fills candidates_ with the k + 1 highest priorities, highest first; fewer if there are fewer.
  void choose(const Vec3& place) {
    double threshold = threshold_ * kCaution;
    for (;;) {
      weigh_above(place, threshold);
      if (candidates_.size() > voices_ || threshold == 0) break;
      threshold = threshold > std::numeric_limits<float>::min() ? threshold / 16 : 0;
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

  // Every source whose priority is at least `threshold`, and above zero.
  void weigh_above(const Vec3& place, double threshold) {
    candidates_.clear();
    passed_.clear();
    screen_.pass(place, threshold, passed_);
    for (const std::uint32_t source : passed_) {
      const double w = weight(field_, weights_, source, place);
      const double priority = w / std::max(u_[source], kLeastU);
      if (w > 0 && priority >= threshold) candidates_.push_back({priority, w, source});
    }
  }

  const SourceField& field_;
  const SignalWeights weights_;
  const std::vector<float> u_;
  const std::size_t voices_;
  const SourceScreen screen_;
  double threshold_ = 0;
  std::vector<std::uint32_t> passed_;
  std::vector<Candidate> candidates_;
  std::optional<Vec3> place_;  // of sample_
  std::vector<SampledSource> sample_;
};

}  // namespace

double weight(const SourceField& field, const SignalWeights& weights, std::size_t source,
              const Vec3& place) {
  const Bands intensity = field.intensity(source, place);
  const Bands& by_band = weights.by_signal[field.signal(source)];
  double sum = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    sum += static_cast<double>(by_band[b]) * intensity[b];
  return sum;
}

std::unique_ptr<Sampler> make_sampler(const std::string& strategy, const SourceField& field,
                                      SignalWeights weights, std::span<const float> u,
                                      std::size_t voices) {
  if (strategy == "all") return std::make_unique<All>(field.size());
  if (strategy == "priority")
    return std::make_unique<Priority>(field, std::move(weights), u, voices);
  return nullptr;
}

}  // namespace clamor
