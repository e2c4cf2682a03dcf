#include "runtime/voices/mix_convolution.h"

#include <algorithm>
#include <array>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "runtime/hrtf/hrtf_filter_bank.h"
#include "runtime/voices/keyframe.h"

namespace clamor {
namespace {

// Noise in 11 pairs, each with its own filter; the second group of lanes is not full.
TEST(FilterPairs, EqualsADirectConvolutionInDoublePrecisionOnEveryInstructionSet) {
  constexpr int kFilters = 11, kGroups = 2, kTaps = 201, kReach = kTaps / 2, kFrames = 700;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<float> filters(kFilters * kTaps);
  for (std::size_t filter = 0; filter < kFilters; ++filter)
    for (std::size_t k = 0; k <= kReach; ++k)
      filters[filter * kTaps + kReach - k] = filters[filter * kTaps + kReach + k] = uniform(random);
  std::vector<float> pairs(std::size_t{2} * kGroups * kFrames * kSpectrumLanes);
  for (float& x : pairs) x = uniform(random);
  const auto input = [&](std::size_t filter, std::size_t ear, std::size_t frame) {
    const std::size_t part = filter / kSpectrumLanes * 2 + ear;
    return static_cast<double>(
        pairs[(part * kFrames + frame) * kSpectrumLanes + filter % kSpectrumLanes]);
  };
  const std::vector<float> spectra = spectra_of(filters, kTaps);
  const auto work = std::make_unique<LaneSpectrum>(), sum = std::make_unique<LaneSpectrum>();
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    filter_pairs({spectra.data(), kGroups, pairs.data(), kFrames, work.get(), sum.get()});
    for (std::size_t ear = 0; ear < 2; ++ear)
      for (std::size_t f = kReach; f < kFrames - kReach; f += 7) {
        double expected = 0, heard = 0;
        for (std::size_t filter = 0; filter < kFilters; ++filter)
          for (std::size_t k = 0; k < kTaps; ++k)
            expected += static_cast<double>(filters[filter * kTaps + k]) *
                        input(filter, ear, f + k - kReach);
        for (std::size_t lane = 0; lane < kSpectrumLanes; ++lane)
          heard +=
              static_cast<double>((ear == 0 ? sum->left : sum->right)[f * kSpectrumLanes + lane]);
        // The sum is about 30, so the tolerance is -100 dB.
        ASSERT_NEAR(heard, expected, 3e-4) << target << ' ' << ear << ' ' << f;
      }
  }
  force_mix_kernel("");
}

}  // namespace
}  // namespace clamor
