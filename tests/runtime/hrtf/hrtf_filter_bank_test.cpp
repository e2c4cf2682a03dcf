#include "runtime/hrtf/hrtf_filter_bank.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/voices/keyframe.h"
#include "runtime/voices/mix_fir.h"
#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

using namespace testing;

TEST(HrtfFilterBank, ReconstructsItsInputWithEqualBands) {
  for (double hz = 20; hz < 20000; hz *= 1.07) {
    double sum = 0;
    for (std::size_t j = 0; j < kHrtfBands; ++j) sum += HrtfFilters::magnitude(j, hz);
    EXPECT_NEAR(sum, 1, 1e-3) << hz;
  }
}

TEST(SumFiltered, EqualsADirectSumInDoublePrecision) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  constexpr int kRows = 5, kTaps = 37, kStride = 300;
  std::vector<float> filters(kRows * kTaps), rows(kRows * kStride), out(256);
  for (float& x : filters) x = uniform(random);
  for (float& x : rows) x = uniform(random);
  for (const std::string& target : mix_kernel_targets())
    for (const int frames : {16, 64, 240, 256}) {
      force_mix_kernel(target);
      sum_filtered({filters.data(), rows.data(), kStride, kRows, kTaps, frames, out.data()});
      for (int f = 0; f < frames; ++f) {
        double sum = 0;
        for (int r = 0; r < kRows; ++r)
          for (int k = 0; k < kTaps; ++k)
            sum += static_cast<double>(filters[static_cast<std::size_t>(r * kTaps + k)]) *
                   rows[static_cast<std::size_t>(r * kStride + f + k)];
        ASSERT_NEAR(out[static_cast<std::size_t>(f)], sum, 3e-5) << target << ' ' << f;
      }
    }
  force_mix_kernel("");
}

TEST(HrtfFilterBank, GivesTheSameBitsForAnyBlockSizes) {
  constexpr int kSteps = 60;  // seven and a half blocks of the filters
  constexpr std::size_t kHigh = kEars * kHrtfHighBands, kLow = kEars * kHrtfLowRows;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<float> high(kHigh * kSteps * kStepFrames),
      low(kLow * kSteps * kStepFrames / kLowRate);
  for (std::vector<float>* rows : {&high, &low})
    for (float& x : *rows) x = uniform(random);
  std::array<std::array<HrtfGains, kEars>, 4> slides{};
  for (auto& levels : slides)
    for (HrtfGains& ear : levels)
      for (float& level : ear) level = 1 + uniform(random);
  const auto heard = [&](const std::vector<int>& steps) {
    const auto bank = std::make_unique<HrtfFilterBank>();
    std::vector<float> out(std::size_t{kEars} * kSteps * kStepFrames);
    const auto give = [&](const std::vector<float>& rows, std::size_t count, int frame, int frames,
                          int rate, float* to) {
      for (std::size_t row = 0; row < count; ++row)
        for (int f = 0; f < frames / rate; ++f)
          to[row * (kMaxFrames / rate) + f] =
              rows[row * (kSteps * kStepFrames / rate) + frame / rate + f];
    };
    int frame = 0;
    for (std::size_t call = 0; frame < kSteps * kStepFrames; ++call) {
      const int left = kKeyframeFrames - frame % kKeyframeFrames;
      const int frames = std::min(steps[call % steps.size()] * kStepFrames, left);
      bank->clear();
      if (left == kKeyframeFrames)
        bank->slide_octaves(slides[static_cast<std::size_t>(frame / kKeyframeFrames)],
                            kKeyframeFrames);
      give(high, kHigh, frame, frames, 1, bank->high());
      give(low, kLow, frame, frames, kLowRate, bank->low());
      give(high, kEars * kHighBands, frame, frames, 1, bank->octaves().high);
      give(low, kEars * kLowBands, frame, frames, kLowRate, bank->octaves().low);
      bank->process(frames, out.data() + kEars * frame);
      frame += frames;
    }
    return out;
  };
  const std::vector<float> whole = heard({4});
  EXPECT_EQ(heard({1}), whole);
  EXPECT_EQ(heard({3, 1, 2, 4, 1}), whole);
}

}  // namespace
}  // namespace clamor
