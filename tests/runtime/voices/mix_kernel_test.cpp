#include "runtime/voices/mix_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "runtime/voices/mix_reference.h"
#include "tests/runtime/instruction_sets.h"

namespace clamor {
namespace {

using testing::KernelGuard;

const MixMode kModes[] = {
    {Interpolation::kLinear, 1, false}, {Interpolation::kLinear, 2, false},
    {Interpolation::kCubic, 1, false},  {Interpolation::kCubic, 2, false},
    {Interpolation::kLinear, 1, true},  {Interpolation::kLinear, 2, true},
    {Interpolation::kCubic, 1, true},   {Interpolation::kCubic, 2, true},
};

// Voices at random positions in white noise, together at full scale. Their delays change by
// nothing, at the speed of a pedestrian, of a car, and of anything up to the speed of sound. Every
// twelfth voice rests: its gains are constant as well.
class ManyVoices {
 public:
  ManyVoices(std::size_t count, const MixMode& mode, unsigned seed) : random_(seed) {
    for (auto* layer : {&high_, &low_})
      for (int i = 0; i < 8192; ++i) layer->push_back(static_cast<float>(between(-1, 1)));
    const double loudness = 1 / std::sqrt(static_cast<double>(count));
    for (std::uint32_t v = 0; v < count; ++v) {
      const bool rests = v % 12 == 0;
      active_.push_back(2 * v + 1);  // only odd slots
      paths_.resize(kEars * (2 * v + 2));
      const double fastest[] = {0, 0.004, 0.1, 0.28, 0.32, 0.999};
      for (int e = 0; e < kEars; ++e) {
        const double fast = fastest[v % std::size(fastest)];
        const auto drift = [&] { return between(-fast, fast); };
        VoicePath& path = paths_[kEars * active_.back() + static_cast<std::size_t>(e)];
        path.high = high_.data();
        path.low = low_.data();
        path.position = static_cast<std::int64_t>(between(16, 7000) * 0x1p32);
        const double first = drift(), last = drift();
        path.step = static_cast<std::int64_t>((1 + first) * 0x1p32);
        path.bend = static_cast<std::int64_t>((last - first) / (kMaxSteps - 1) * 0x1p32);
      }
      gaps_.resize(2 * v + 2);
      if (mode.delays == 2)
        gaps_.back() = {static_cast<std::int64_t>(between(-15, 15) * 0x1p32),
                        rests ? 0 : static_cast<std::int64_t>(between(-0.01, 0.01) * 0x1p32)};
      // The gains of the others change from any value to any other within 960 frames.
      const auto lanes = static_cast<std::size_t>(mode.gain_lanes());
      gains_.resize(2 * lanes * (2 * v + 2));
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        const double from = between(-loudness, loudness), to = between(-loudness, loudness);
        float* const gain = &gains_[2 * lanes * active_.back() + lane];
        gain[0] = static_cast<float>(from);
        gain[lanes] = rests ? 0 : static_cast<float>((to - from) * kGainFrames / 960);
      }
    }
  }

  MixJob job(int first_frame, int frames, MixBuses* buses) const {
    return {paths_.data(),
            gains_.data(),
            active_.data(),
            active_.size(),
            first_frame,
            frames,
            buses ? buses->high : nullptr,
            buses ? buses->low : nullptr,
            gaps_.data()};
  }

 private:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  std::mt19937 random_;
  std::vector<float> high_, low_, gains_;
  std::vector<VoicePath> paths_;
  std::vector<LayerOffset> gaps_;
  std::vector<std::uint32_t> active_;
};

TEST(MixKernel, HasMoreThanOneImplementation) {
  const auto targets = mix_kernel_targets();
  EXPECT_GE(targets.size(), 2u);
  const KernelGuard guard;
  for (const std::string& target : targets) {
    force_mix_kernel(target);
    EXPECT_EQ(mix_kernel_target(), target);
  }
}

TEST(MixKernel, EqualsTheDoublePrecisionReferenceOnEveryInstructionSet) {
  const KernelGuard guard;
  for (const std::size_t count : {1u, 3u, 70u}) {  // 70 is more than a tile
    for (const MixMode& mode : kModes) {
      const ManyVoices crowd(count, mode, static_cast<unsigned>(count));
      for (int steps = 1; steps <= kMaxSteps; ++steps) {
        const int first = 960 - steps * kStepFrames, frames = steps * kStepFrames;
        const auto expected = std::make_unique<ReferenceBuses>();
        mix_reference(mode, crowd.job(first, frames, nullptr), *expected);
        for (const std::string& target : mix_kernel_targets()) {
          force_mix_kernel(target);
          const auto buses = std::make_unique<MixBuses>();
          mix_voices(mode, crowd.job(first, frames, buses.get()));
          double worst = 0, loudest = 0;
          for (std::size_t i = 0; i < std::size(buses->high); ++i) {
            worst = std::max(worst, std::abs(buses->high[i] - expected->high[i]));
            loudest = std::max(loudest, std::abs(expected->high[i]));
          }
          for (std::size_t i = 0; i < std::size(buses->low); ++i)
            worst = std::max(worst, std::abs(buses->low[i] - expected->low[i]));
          EXPECT_LT(worst, 1e-5) << target << ", " << count << " voices, " << frames << " frames, "
                                 << (mode.interpolation == Interpolation::kCubic) << mode.delays
                                 << mode.eight_bands;  // -100 dB
          EXPECT_GT(loudest, 0.1);
        }
      }
    }
  }
}

// Mixes three upper HRTF bands at a time, then five lower ones, then their quadratures, as if they
// were octaves.
TEST(MixKernel, EqualsTheReferenceInEveryHrtfBand) {
  const KernelGuard guard;
  constexpr std::size_t kVoices = 70, kSlots = 2 * kVoices;
  constexpr int kLowRow = kMaxFrames / kLowRate;
  for (const Interpolation curve : {Interpolation::kLinear, Interpolation::kCubic}) {
    MixMode head{curve};
    head.head = true;
    const MixMode octaves{curve};
    const ManyVoices crowd(kVoices, head, 9);
    for (const std::string& target : mix_kernel_targets()) {
      force_mix_kernel(target);
      struct Buses {
        alignas(64) std::array<float, kEars * kHrtfHighBands * kMaxFrames> high;
        alignas(64) std::array<float, kEars * kHrtfLowRows * kLowRow> low;
      };
      const auto buses = std::make_unique<Buses>();  // zero-initialized
      auto& [high, low] = *buses;
      MixJob job = crowd.job(0, kMaxFrames, nullptr);
      job.high = high.data();
      job.low = low.data();
      mix_voices(head, job);
      double worst = 0, loudest = 0;
      for (std::size_t group = 0; kHighBands * group < kHrtfHighBands; ++group) {
        std::vector<float> gains(2 * kSlots * kBandLanes);
        for (std::size_t row = 0; row < 2 * kSlots; ++row)
          for (std::size_t lane = 0; lane < kBandLanes; ++lane) {
            const std::size_t octave = lane / kEars;
            const std::size_t row_here = (kLowBands * group + octave) % kHrtfLowRows;
            const std::size_t band = octave >= kLowBands
                                         ? kHrtfLowBands + kHighBands * group + octave - kLowBands
                                     : row_here < kHrtfLowBands ? row_here
                                                                : row_here + kHrtfHighBands;
            gains[row * kBandLanes + lane] =
                job.gains[row * kHrtfLanes + kEars * band + lane % kEars];
          }
        MixJob part = job;
        part.gains = gains.data();
        const auto expected = std::make_unique<ReferenceBuses>();
        mix_reference(octaves, part, *expected);
        const auto compare = [&](float ours, double theirs) {
          worst = std::max(worst, std::abs(static_cast<double>(ours) - theirs));
          loudest = std::max(loudest, std::abs(theirs));
        };
        for (std::size_t i = 0; i < std::size(expected->high); ++i)
          compare(high[kEars * kHighBands * group * kMaxFrames + i], expected->high[i]);
        for (std::size_t i = 0; i < std::size(expected->low); ++i)
          compare(low[(kEars * kLowBands * group * kLowRow + i) % low.size()], expected->low[i]);
      }
      EXPECT_LT(worst, 1e-5) << target;  // -100 dB
      EXPECT_GT(loudest, 0.1);
    }
  }
}

TEST(MixKernel, GivesTheSameBitsForAnyBlockSizes) {
  const KernelGuard guard;
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    for (const MixMode& mode : kModes) {
      const ManyVoices crowd(30, mode, 5);
      const auto whole = std::make_unique<MixBuses>(), parts = std::make_unique<MixBuses>();
      mix_voices(mode, crowd.job(0, kMaxFrames, whole.get()));
      for (int step = 0; step < kMaxSteps; ++step) {
        // The second part starts later by these frames, in buses that start there.
        MixJob job = crowd.job(step * kStepFrames, kStepFrames, parts.get());
        std::vector<VoicePath> later(job.paths, job.paths + kEars * (2 * 30));
        for (VoicePath& path : later) {
          path.position = path.position_at(step * kStepFrames);
          path.step = path.step_at(step * kStepFrames);
        }
        std::vector<LayerOffset> gaps(job.gaps, job.gaps + 2 * 30);
        for (LayerOffset& gap : gaps) gap.ahead += step * kStepFrames * gap.step;
        job.paths = later.data();
        job.gaps = gaps.data();
        job.high += step * kStepFrames;
        job.low += step * kStepFrames / kLowRate;
        mix_voices(mode, job);
      }
      EXPECT_TRUE(std::ranges::equal(whole->high, parts->high)) << target;
      EXPECT_TRUE(std::ranges::equal(whole->low, parts->low)) << target;
    }
  }
}

TEST(MixKernel, ReturnsWhereVoicesContinue) {
  const KernelGuard guard;
  constexpr std::size_t kVoices = 100, kSlots = 2 * kVoices;  // more than a tile
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    for (const MixMode& mode : kModes)
      for (const int frames : {kStepFrames, kMaxFrames}) {
        const ManyVoices crowd(kVoices, mode, 6);
        const auto buses = std::make_unique<MixBuses>();
        MixJob job = crowd.job(0, frames, buses.get());
        const std::vector<VoicePath> before(job.paths, job.paths + kEars * kSlots);
        const std::vector<LayerOffset> gaps_before(job.gaps, job.gaps + kSlots);
        auto paths = before;
        auto gaps = gaps_before;
        const std::int64_t wrap = std::int64_t{4000} << 32;
        const std::vector<std::int64_t> wraps(kSlots, wrap);
        job.paths = paths.data();
        job.gaps = gaps.data();
        job.next = {paths.data(), gaps.data(), wraps.data()};
        mix_voices(mode, job);
        for (std::size_t slot = 0; slot < kSlots; ++slot) {
          const bool sounds = slot % 2 == 1;
          EXPECT_EQ(gaps[slot].ahead,
                    gaps_before[slot].ahead + (sounds ? frames * gaps_before[slot].step : 0));
          for (std::size_t e = 0; e < kEars; ++e) {
            const VoicePath &was = before[kEars * slot + e], &is = paths[kEars * slot + e];
            const bool goes_on = sounds && e < static_cast<std::size_t>(mode.delays);
            const std::int64_t position = goes_on ? was.position_at(frames) : was.position;
            EXPECT_EQ(is.position, position - (goes_on && position >= wrap ? wrap : 0));
            EXPECT_EQ(is.step, goes_on ? was.step_at(frames) : was.step);
            EXPECT_EQ(is.bend, was.bend);
          }
        }
      }
  }
}

}  // namespace
}  // namespace clamor
