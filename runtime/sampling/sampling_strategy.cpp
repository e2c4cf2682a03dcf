#include "runtime/sampling/sampling_strategy.h"

#include "runtime/sampling/sampler.h"

namespace clamor {

namespace {

class PriorityStrategy final : public SamplingStrategy {
 public:
  std::string name() const override { return "priority"; }
  std::unique_ptr<Sampler> make_sampler(const SamplerInput& input) const override {
    return make_priority_sampler(input.radiation, input.weights, input.pool, input.voices,
                                 input.occlusion, input.bound);
  }
};

}  // namespace

std::shared_ptr<const SamplingStrategy> priority_strategy() {
  static const auto kPriority = std::make_shared<const PriorityStrategy>();
  return kPriority;
}

}  // namespace clamor
