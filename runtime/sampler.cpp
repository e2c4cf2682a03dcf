#include "runtime/sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

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
      : field_(field), weights_(std::move(weights)), u_(u.begin(), u.end()), voices_(voices) {
    bounds_.reserve(field.size());
    for (std::size_t i = 0; i < field.size(); ++i) {
      const double nearest_m = field.radius_m(i);
      const double key =
          static_cast<double>(field.ceiling(i, weights_.by_signal[field.signal(i)]).highest()) / std::max(u_[i], kLeastU);
      const Vec3 position = field.position_m(i);
      // Rounding must never make a bound too low.
      bounds_.x.push_back(static_cast<float>(position.x));
      bounds_.y.push_back(static_cast<float>(position.y));
      bounds_.z.push_back(static_cast<float>(position.z));
      bounds_.nearest2_m2.push_back(static_cast<float>(nearest_m * nearest_m));
      bounds_.key.push_back(static_cast<float>(key * kSlack));
    }
  }

  std::span<const SampledSource> sample(const Vec3& place) override {
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
  static constexpr float kLeastU = 0x1p-32f;
  // Floats round positions by up to a millimetre (10 km from the origin) and the rest by 1e-6.
  static constexpr double kSlack = 1.00001;
  static constexpr float kGive = 0.001f;
  // The last threshold lowered by this catches k sources nearly always when a listener walks.
  static constexpr double kCaution = 0.7;

  struct Bounds {
    std::vector<float> x, y, z, nearest2_m2, key;
    void reserve(std::size_t size) {
      for (auto* column : {&x, &y, &z, &nearest2_m2, &key}) column->reserve(size);
    }
  };
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
    const auto x = static_cast<float>(place.x), y = static_cast<float>(place.y),
               z = static_cast<float>(place.z);
    const auto least = static_cast<float>(threshold * (1 - 1e-6));
    const std::size_t size = field_.size();
    constexpr std::size_t kChunk = 1024;
    std::uint8_t passes[kChunk];
    for (std::size_t first = 0; first < size; first += kChunk) {
      const std::size_t count = std::min(kChunk, size - first);
      const float* const px = bounds_.x.data() + first;
      const float* const py = bounds_.y.data() + first;
      const float* const pz = bounds_.z.data() + first;
      const float* const nearest2 = bounds_.nearest2_m2.data() + first;
      const float* const key = bounds_.key.data() + first;
      for (std::size_t i = 0; i < count; ++i) {
        const float dx = px[i] - x, dy = py[i] - y, dz = pz[i] - z;
        const float r2 = dx * dx + dy * dy + dz * dz;
        // (r - g)^2 >= r^2 (1 - g) - g for a give of g metres, because 2 r g <= g r^2 + g.
        const float d2 = std::max(r2 * (1 - kGive) - kGive, nearest2[i]);
        passes[i] = key[i] >= least * d2;
      }
      for (std::size_t i = 0; i < count; ++i)
        if (passes[i]) weigh(first + i, place, threshold);
    }
  }

  void weigh(std::size_t source, const Vec3& place, double threshold) {
    const double w = weight(field_, weights_, source, place);
    const double priority = w / std::max(u_[source], kLeastU);
    if (w > 0 && priority >= threshold)
      candidates_.push_back({priority, w, static_cast<std::uint32_t>(source)});
  }

  const SourceField& field_;
  const SignalWeights weights_;
  const std::vector<float> u_;
  const std::size_t voices_;
  Bounds bounds_;
  double threshold_ = 0;
  std::vector<Candidate> candidates_;
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
