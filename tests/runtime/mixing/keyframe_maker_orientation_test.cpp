// keyframe_maker_orientation_test.cpp: heads that yaw, pitch and roll, in free field.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "common/air.h"
#include "common/listener.h"
#include "common/random.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/sampling/sampler.h"
#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

constexpr double kQuarterTurn_rad = std::numbers::pi / 2;

// Emitters and reflections all around a listener, in any orientation.
class RotatedWorld {
 public:
  static constexpr std::uint32_t kSources = 64;

  explicit RotatedWorld(const Quaternion& rotation = {1, 0, 0, 0}) : emitters_(2), materials_(1) {
    emitters_[1].directivity = same_in_all_bands(2);
    radiation_ = std::make_unique<RadiationModel>(emitters_, materials_, Air{});
    for (std::uint32_t i = 0; i < kSources; ++i) {
      Source& source = sources_.emplace_back();
      source.position_m = Vec3f(rotation * (8.0 * random(i, 0)));
      const Vec3 normal = normalize(random(i, 1));
      source.normal = Vec3f(rotation * normal);
      source.mirror = Vec3f(rotation * normalize(normal + 0.3 * random(i, 2)));
      source.is_emitter = i % 2 == 0;
      source.emitter = i / 2 % 2;
      if (source.is_emitter) source.mirror = source.normal;
      source.power = same_in_all_bands(1);
    }
  }

  // Voices of a listener with a pair of receivers or an HRTF.
  Keyframe heard_by(const Listener& listener,
                    KeyframeMaker::Receivers receivers = KeyframeMaker::Receivers::kPair,
                    const ReceiverPattern& pattern = {}) const {
    std::vector<SampledSource> sample;
    for (std::uint32_t i = 0; i < kSources; ++i) sample.push_back({i, 1, &sources_[i]});
    const auto head =
        receivers == KeyframeMaker::Receivers::kPair
            ? nullptr
            : std::shared_ptr<const Hrtf>(std::shared_ptr<void>(), &testing::kemar_head());
    KeyframeMaker maker(*radiation_, kSources, receivers, head);
    Keyframe keyframe;
    keyframe.voices.reserve(kSources);
    maker.make(sample, listener, keyframe, Reception(pattern, listener));
    return keyframe;
  }

 private:
  static Vec3 random(std::uint32_t i, std::uint32_t use) {
    const RandomBits bits = philox(4, {i, use, 0, 0});
    return Vec3(2 * unit(bits[0]) - 1, 2 * unit(bits[1]) - 1, 2 * unit(bits[2]) - 1);
  }

  std::vector<Emitter> emitters_;
  std::vector<Material> materials_;
  std::unique_ptr<RadiationModel> radiation_;
  std::vector<Source> sources_;
};

Keyframe lone_emitter_at(const Vec3& position_m, const Listener& listener) {
  const std::vector<Emitter> emitters(1);
  const RadiationModel radiation(emitters, {}, Air{});
  Source source;
  source.position_m = Vec3f(position_m);
  source.normal = source.mirror = {0, -1, 0};
  source.is_emitter = true;
  source.power = same_in_all_bands(1);
  const SampledSource sampled{0, 1, &source};
  KeyframeMaker maker(radiation, 1);
  Keyframe keyframe;
  keyframe.voices.reserve(1);
  maker.make({&sampled, 1}, listener, keyframe);
  return keyframe;
}

TEST(KeyframeMaker, LetsAHeadRolledByAQuarterTurnHearASourceAboveAtTheUpperEar) {
  const Vec3 above_m(0, 5, 0);
  const Keyframe upright = lone_emitter_at(above_m, Listener());
  const Keyframe right = lone_emitter_at(above_m, Listener({}, 0, 0, kQuarterTurn_rad));
  const Keyframe left = lone_emitter_at(above_m, Listener({}, 0, 0, -kQuarterTurn_rad));
  const auto from = [](const Keyframe& keyframe) { return keyframe.voices.at(0).from; };
  EXPECT_LE(length(from(upright) - Vec3f(0, 0, 1)), 1e-6f) << "above";
  EXPECT_LE(length(from(right) - Vec3f(0, 1, 0)), 1e-6f) << "the right shoulder is down";
  EXPECT_LE(length(from(left) - Vec3f(0, -1, 0)), 1e-6f) << "the left shoulder is down";

  const auto later_at_right = [](const Keyframe& keyframe) {
    const auto& delays = keyframe.voices.at(0).delay_frames;
    return delays[1] - delays[0];
  };
  const double ears_frames = kEarDistance_m / speed_of_sound_mps(Air{}) * kSampleRate_hz;
  EXPECT_NEAR(later_at_right(upright), 0, 1e-6);
  EXPECT_NEAR(later_at_right(right), ears_frames, 1e-6);
  EXPECT_NEAR(later_at_right(left), -ears_frames, 1e-6);
}

// Turning the world and the listener together changes nothing that is heard, however it is turned.
TEST(KeyframeMaker, MakesTheSameVoicesOfAWorldAndAListenerThatAreTurnedTogether) {
  const Vec3 place_m(0.3, -0.2, 0.5);
  const Orientation facing(HeadAngles{0.4, -0.3, 0.2});
  const ReceiverPattern patterns[] = {{}, *ReceiverPattern::named("ortf")};
  for (std::uint32_t turn = 0; turn < 8; ++turn) {
    const RandomBits bits = philox(5, {turn, 0, 0, 0});
    const Quaternion rotation =
        Orientation(HeadAngles{6 * unit(bits[0]), 3 * unit(bits[1]) - 1.5, 6 * unit(bits[2])})
            .rotation();
    const RotatedWorld world, turned(rotation);
    const Listener before(place_m, facing);
    const Listener after(rotation * place_m, Orientation(rotation * facing.rotation()));
    for (const KeyframeMaker::Receivers receivers :
         {KeyframeMaker::Receivers::kPair, KeyframeMaker::Receivers::kOne})
      for (const ReceiverPattern& pattern : patterns) {
        const bool is_head = receivers == KeyframeMaker::Receivers::kOne;
        if (is_head && (turn > 1 || !(pattern == ReceiverPattern()))) continue;
        const Keyframe a = world.heard_by(before, receivers, pattern);
        const Keyframe b = turned.heard_by(after, receivers, pattern);
        ASSERT_EQ(a.voices.size(), b.voices.size());
        // Positions and directions are floats. A cardioid's amplitude is a root near its null.
        for (std::size_t v = 0; v < a.voices.size(); ++v) {
          EXPECT_LE(length(a.voices[v].from - b.voices[v].from), 1e-5f);
          for (std::size_t e = 0; e < kEars; ++e) {
            EXPECT_NEAR(a.voices[v].delay_frames[e], b.voices[v].delay_frames[e], 1e-3);
            for (std::size_t band = 0; band < kBandCount; ++band)
              EXPECT_NEAR(a.voices[v].gain[e][band], b.voices[v].gain[e][band],
                          1e-5 + 1e-3 * std::abs(a.voices[v].gain[e][band]));
          }
        }
      }
  }
}

}  // namespace
}  // namespace clamor
