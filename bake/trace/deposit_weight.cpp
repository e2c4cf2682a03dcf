#include "bake/trace/deposit_weight.h"

#include <numbers>

#include "bake/trace/weight_window.h"

namespace clamor {

DepositWeight::DepositWeight(const DecayModel& decay) : knee_m_(decay.knee_m) {
  if (!decay.is_known()) return;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    early_log2_loss_per_m_[b] = std::numbers::log2e_v<float> / decay.early_m[b];
    late_log2_loss_per_m_[b] = std::numbers::log2e_v<float> / decay.late_m[b];
  }
}

}  // namespace clamor
