#include "runtime/propagation/intensity_kernel.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/runtime/instruction_sets.h"
#include "tests/runtime/varied_sources.h"

namespace clamor {
namespace {

using testing::KernelGuard;
using testing::SourcesOfAllKinds;

constexpr Vec3 kListener_m(7.25, 1.5, 3);

std::vector<ReceivedIntensity> received_together(const SourcesOfAllKinds& sources,
                                                 std::size_t count) {
  std::vector<const Source*> all;
  for (std::size_t i = 0; i < count; ++i) all.push_back(&sources[i]);
  std::vector<ReceivedIntensity> received(count);
  sources.radiation().receive(all, kListener_m, received.data());
  return received;
}

TEST(IntensityKernel, EqualsTheExactIntensitiesOnEveryInstructionSet) {
  const KernelGuard guard;
  const SourcesOfAllKinds sources(kListener_m);
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    const auto received = received_together(sources, SourcesOfAllKinds::kCount);
    double worst = 0, worst_m = 0;
    std::size_t heard = 0;
    for (std::size_t i = 0; i < received.size(); ++i) {
      const Bands exact = sources.exactly(i, kListener_m);
      const auto loudest = static_cast<double>(*std::max_element(exact.begin(), exact.end()));
      heard += loudest > 0;
      for (std::size_t b = 0; b < kBandCount; ++b) {
        // A lobe of exponent 1000 multiplies the rounding error of a cosine by a thousand.
        const double error = std::abs(static_cast<double>(received[i].intensity[b] - exact[b]));
        worst = std::max(worst,
                         error / (1e-4 * static_cast<double>(exact[b]) + 1e-5 * loudest + 1e-18));
      }
      const double distance_m = length(kListener_m - Vec3(sources[i].position_m));
      worst_m = std::max(worst_m, std::abs(received[i].distance_m - distance_m));
    }
    EXPECT_LT(worst, 1) << target;
    EXPECT_LT(worst_m, 1e-12) << target;
    EXPECT_GT(heard, SourcesOfAllKinds::kCount / 2);
    EXPECT_LT(heard, SourcesOfAllKinds::kCount);  // some radiate away from the listener
  }
}

TEST(IntensityKernel, GivesTheSameBitsOnEveryInstructionSetAndInAnyBatch) {
  const KernelGuard guard;
  const SourcesOfAllKinds sources(kListener_m);
  force_mix_kernel("");
  const auto expected = received_together(sources, SourcesOfAllKinds::kCount);
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    const auto some = received_together(sources, 21);  // not a multiple of the vector size
    std::size_t differ = 0;
    for (std::size_t i = 0; i < expected.size(); ++i)
      differ += sources.radiation().intensity(sources[i], kListener_m) != expected[i].intensity;
    for (std::size_t i = 0; i < some.size(); ++i)
      differ += some[i].intensity != expected[i].intensity ||
                some[i].distance_m != expected[i].distance_m;
    EXPECT_EQ(differ, 0u) << target;
  }
}

TEST(IntensityKernel, GivesNothingForAnEmptyBatch) {
  const SourcesOfAllKinds sources(kListener_m);
  ReceivedIntensity untouched;
  untouched.distance_m = 7;
  sources.radiation().receive({}, kListener_m, &untouched);
  EXPECT_EQ(untouched.distance_m, 7);
}

}  // namespace
}  // namespace clamor
