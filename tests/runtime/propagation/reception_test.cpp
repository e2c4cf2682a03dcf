// reception_test.cpp: directional sensitivity of a pair of receivers, from the formula to the
// output.
#include "runtime/propagation/reception.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "common/directivity.h"
#include "common/random.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/mixing/output_format.h"
#include "runtime/output/loudness_meter.h"
#include "tests/runtime/priority_sample_reference.h"
#include "tests/runtime/weighted_room.h"
#include "tests/sanitized.h"
#include "tools/strategies/representative_octree.h"

namespace clamor {
namespace {

using ReceptionRoom = testing::WeightedRoom;

constexpr double kDegree = std::numbers::pi / 180;

// The pattern differs in each band and is omnidirectional only in the lowest.
ReceiverPattern uneven() { return {{0, 0.5f, 1, 1.5f, 2, 3, 5, 9}, 40 * kDegree}; }

Vec3 direction(std::uint32_t i) {
  const RandomBits bits = philox(4, {i, 0, 0, 0});
  const double up = 2 * unit(bits[0]) - 1, turn = 2 * std::numbers::pi * unit(bits[1]);
  const double r = std::sqrt(1 - up * up);
  return {r * std::cos(turn), up, r * std::sin(turn)};
}

Listener pose_at(std::uint32_t i) {
  const RandomBits bits = philox(5, {i, 0, 0, 0});
  return {{6 * unit(bits[0]), 8 * unit(bits[1]), 3 * unit(bits[2])},
          7 * unit(bits[3]) - 3.5,
          unit(bits[2]) - 0.5};
}

// Sensitivity in double precision, straight from its definition.
double intensity(const ReceiverPattern& pattern, const Listener& pose, int ear, std::size_t band,
                 const Vec3& towards) {
  const double side = ear == 0 ? -1 : 1;
  const Vec3 axis = std::cos(pattern.angle_rad) * pose.forward() +
                    side * std::sin(pattern.angle_rad) * pose.right();
  return emission(pattern.exponent[band], dot(axis, towards));
}

TEST(Reception, FollowsTheEmissionLawAroundEachReceiversAxis) {
  for (const ReceiverPattern& pattern : {uneven(), *ReceiverPattern::named("ortf")})
    for (std::uint32_t i = 0; i < 200; ++i) {
      const Listener pose = pose_at(i);
      const Reception reception(pattern, pose);
      const Vec3 towards = direction(i);
      const Bands share = reception.share(Vec3f(3.0 * towards));
      for (std::size_t b = 0; b < kBandCount; ++b) {
        double mean = 0;
        for (int e = 0; e < kEars; ++e) {
          const double right = intensity(pattern, pose, e, b, towards);
          const double gain = reception.gain(e, Vec3f(0.1 * towards))[b];
          EXPECT_NEAR(gain * gain, right, 2e-6);
          mean += right / 2;
        }
        EXPECT_NEAR(share[b], mean, 2e-6);
        EXPECT_LE(share[b], 1);
      }
    }
}

TEST(Reception, OfAnOrtfPairIsTwoCardioids110DegreesApart) {
  const Reception pair(*ReceiverPattern::named("ortf"), Listener{});
  const auto level_db = [&](int ear, double to_the_left_deg) {
    const double a = to_the_left_deg * kDegree;
    return 20 * std::log10(pair.gain(ear, Vec3f(Vec3(-std::sin(a), 0, -std::cos(a))))[4]);
  };
  EXPECT_NEAR(level_db(0, 55), 0, 1e-5);
  EXPECT_NEAR(level_db(1, -55), 0, 1e-5);
  EXPECT_NEAR(level_db(0, 145), 20 * std::log10(0.5), 1e-5);  // from its side
  EXPECT_LT(level_db(0, -125), -100);                         // from behind it
  EXPECT_NEAR(level_db(0, 0), level_db(1, 0), 1e-5);
}

TEST(Reception, OfAWidePairIncludesTheRearAndSeparatesTheSides) {
  const Reception pair(*ReceiverPattern::named("wide"), Listener{});
  const auto level_db = [&](int ear, double to_the_left_deg) {
    const double a = to_the_left_deg * kDegree;
    return 20 * std::log10(pair.gain(ear, Vec3f(Vec3(-std::sin(a), 0, -std::cos(a))))[4]);
  };
  EXPECT_NEAR(level_db(0, 0), 10 * std::log10((1 + std::cos(55 * kDegree)) / 2), 1e-4);
  EXPECT_NEAR(level_db(0, 180), 10 * std::log10((1 + std::cos(125 * kDegree)) / 2), 1e-4);
  EXPECT_NEAR(level_db(1, 180), level_db(0, 180), 1e-5);
  EXPECT_GT(level_db(0, 90) - level_db(1, 90), 10);
}

TEST(Reception, OfOmniIsUnityAndUnknownNamesAreRejected) {
  const Reception omni(*ReceiverPattern::named("omni"), pose_at(1));
  EXPECT_TRUE(omni.is_omnidirectional());
  EXPECT_EQ(omni.gain(0, {0, 0, 1}), same_in_all_bands(1));
  const auto unknown = OutputFormat::from_options(false, "", false, "ears");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().message,
            "--receivers: no receivers are called 'ears'; there are 'omni', 'ortf' and 'wide'.");
  EXPECT_FALSE(OutputFormat::from_options(true, "", false, "ortf").ok());
  EXPECT_EQ(OutputFormat::from_options(false, "", false, "ortf")->receivers.exponent[0], 2);
}

TEST(Reception, WeighsASourceByTheMeanOfBothReceivers) {
  const ReceptionRoom room(400);
  for (std::uint32_t i = 0; i < 300; ++i) {
    const Listener pose = pose_at(i);
    const Source& source = room.sources()[i];
    const Bands free = room.radiation.intensity(source, pose.position_m);
    const Vec3 towards = normalize(Vec3(source.position_m) - pose.position_m);
    double expected = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      for (int e = 0; e < kEars; ++e)
        expected += static_cast<double>(room.weights.by_signal[room.radiation.signal(source)][b]) *
                    free[b] * intensity(uneven(), pose, e, b, towards) / 2;
    EXPECT_NEAR(room.weight_of(i, pose.position_m, Reception(uneven(), pose)), expected,
                1e-5 * expected);
  }
}

// Like PrioritySampler.GivesTheSampleOfASortOfAllPriorities, for a listener who walks, stands and
// turns.
TEST(Reception, EntersThePrioritiesExactly_NoAsan) {
  const ReceptionRoom room(400);
  constexpr std::size_t kVoices = 200;
  SourceList list = room.list();
  const auto sampler = make_priority_sampler(room.radiation, room.weights, list, kVoices);
  for (std::uint32_t step = 0; step < 90; ++step) {
    Listener pose{{1 + 0.05 * step, 2 + 0.03 * step, 1.5}, 0.1 * step, 0.2};
    if (step >= 40) pose.position_m = {3, 4, 1.5};  // turns on the spot
    if (step >= 60) pose = pose_at(step);
    const Reception reception(uneven(), pose);
    std::vector<testing::WeightedSource> all;
    for (std::size_t i = 0; i < room.sources().size(); ++i)
      all.push_back({i, room.weight_of(i, pose.position_m, reception), room.sources()[i].u});
    const auto expected = testing::reference_sample(std::move(all), kVoices);
    ASSERT_EQ(expected.size(), kVoices);
    sampler->set_reception(reception);
    testing::expect_sample(sampler->sample(pose.position_m), expected, 1e-12);
    if (HasFatalFailure()) FAIL() << "step " << step;
  }
}

// The points are symmetric to the front and back, and the listener is more sensitive to the front.
TEST(Reception, OpensTheNodesOfTheRepresentativeOctreeInFront) {
  std::vector<RepresentativeOctree::Point> points;
  for (std::uint32_t i = 0; i < 4000; ++i) {
    const RandomBits bits = philox(6, {i / 2, 0, 0, 0});
    const double z = 5 + 20 * unit(bits[0]);
    points.push_back(
        {Vec3(20 * unit(bits[1]) - 10, 5 * unit(bits[2]), i % 2 == 0 ? -z : z), 1, 0.1});
  }
  const RepresentativeOctree tree(points, 2, 1);
  const auto ahead = [&](const Reception& reception) {
    const auto cut = tree.cut({0, 1.5, 0}, 300, reception);
    const auto before = std::count_if(cut.begin(), cut.end(), [&](const auto& representative) {
      return points[representative.point].position_m.z < 0;
    });
    return static_cast<double>(before) / static_cast<double>(cut.size());
  };
  EXPECT_NEAR(ahead(Reception()), 0.5, 0.05);
  const ReceiverPattern forward{same_in_all_bands(4), 0};
  EXPECT_GT(ahead(Reception(forward, Listener{})), 0.85);
  const Listener back({}, std::numbers::pi, 0);
  EXPECT_LT(ahead(Reception(forward, back)), 0.15);
}

// Compared with the voices of omnidirectional receivers.
TEST(Reception, EntersTheGainsOfVoicesAtEachReceiver) {
  const ReceptionRoom room(400);
  using Receivers = KeyframeMaker::Receivers;
  KeyframeMaker even(room.radiation, 400, Receivers::kPair);
  KeyframeMaker maker(room.radiation, 400, Receivers::kPair);
  std::vector<SampledSource> sample;
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Source& source = room.sources()[i];
    sample.push_back({i, 1, &source, room.radiation.signal(source)});
  }
  Keyframe with, without;
  with.voices.reserve(400);
  without.voices.reserve(400);
  std::size_t heard = 0;
  ListenerMotion motion(kKeyframe_s);
  for (std::uint32_t k = 0; k < 30; ++k) {
    Listener pose{{2 + 0.02 * k, 3, 1.5}, 0.05 * k, 0};
    if (k >= 10 && k < 20) pose = {{2.2, 3, 1.5}, 0.5, 0};  // stands still
    sample[7].power_scale = k < 15 ? 1 : 4;                 // but its voice is updated
    pose = motion.next(pose);
    even.make(sample, pose, without);
    maker.make(sample, pose, with, Reception(uneven(), pose));
    ASSERT_EQ(with.voices.size(), without.voices.size());
    for (std::size_t v = 0; v < with.voices.size(); ++v) {
      const Voice &one = with.voices[v], &other = without.voices[v];
      const Source& source = room.sources()[v];
      ASSERT_EQ(one.delay_frames, other.delay_frames);
      for (int e = 0; e < kEars; ++e) {
        const Vec3 ear_m = pose.position_m + (e == 0 ? -0.5 : 0.5) * kEarDistance_m * pose.right();
        const Vec3 towards = normalize(Vec3(source.position_m) - ear_m);
        for (std::size_t b = 0; b < kBandCount; ++b) {
          const double share = std::sqrt(intensity(uneven(), pose, e, b, towards));
          ASSERT_NEAR(one.gain[e][b], share * other.gain[e][b],
                      1e-5 * std::abs(other.gain[e][b]) + 1e-9)
              << "keyframe " << k << " voice " << v;
          heard += other.gain[e][b] != 0;
        }
      }
    }
  }
  EXPECT_GT(heard, 10'000u);
}

}  // namespace
}  // namespace clamor
