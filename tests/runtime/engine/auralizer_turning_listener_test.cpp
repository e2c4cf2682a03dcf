// auralizer_turning_listener_test.cpp: the latency of head rotation and of motion of the listener,
// in frames.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/hrtf/hrtf_filter_bank.h"
#include "runtime/mixing/head_rotation.h"
#include "runtime/mixing/keyframe_lead.h"
#include "runtime/mixing/mixer.h"
#include "runtime/voices/octave_filter_bank.h"
#include "tests/baked_room.h"
#include "tests/runtime/hrtf_mixing.h"
#include "tools/strategies/strategies.h"

namespace clamor {
namespace {

constexpr std::size_t kBlock = 256, kThird = kKeyframeFrames / 3;
constexpr double kDegrees = std::numbers::pi / 180;
constexpr double kStartYaw_rad = 0.5;
const Listener kStart{{4, 5, 1.6}, kStartYaw_rad, 0};

enum class TurningOutput : std::uint8_t { kPair, kLoudspeakers, kHead };

OutputFormat output_shape_of(TurningOutput output) {
  if (output == TurningOutput::kHead) {
    OutputFormat shape = *OutputFormat::from_options(true, "", false);
    shape.head = {std::shared_ptr<void>(), &testing::kemar_head()};
    return shape;
  }
  return *OutputFormat::from_options(false, output == TurningOutput::kLoudspeakers ? "5.1" : "",
                                     false);
}

// Frames by which the mixer compensates the delay of its filters.
std::size_t lead_frames(TurningOutput output) {
  return output == TurningOutput::kHead ? kHrtfDelayFrames : kBankDelayFrames;
}

std::unique_ptr<Auralizer> following_auralizer(TurningOutput output, bool tracks_head,
                                               AuralizerInput input = testing::baked_room(60)) {
  AuralizerOptions options;
  options.strategy = make_strategy("all");
  options.visibility = false;
  options.output = output_shape_of(output);
  options.block_frames = kBlock;
  options.tracks_head = tracks_head;
  // makes keyframes in no time
  options.sampler_clock = {[](void*) noexcept { return 0.0; }, nullptr};
  auto auralizer = Auralizer::create(std::move(input), options);
  EXPECT_TRUE(auralizer.ok());
  return std::move(*auralizer);
}

// Mixes `blocks` blocks. face(frame) and place(frame) give the listener at the first frame of each
// block; no keyframe is made where place() returns nothing.
template <class Place, class Face>
std::vector<float> played_blocks(Auralizer& auralizer, std::size_t blocks, std::size_t block_frames,
                                 Place place, Face face) {
  const std::size_t samples = block_frames * static_cast<std::size_t>(auralizer.channels());
  std::vector<float> all(blocks * samples);
  for (std::size_t b = 0; b < blocks; ++b) {
    const std::size_t frame = b * block_frames;
    auralizer.turn_head(face(frame));
    while (auralizer.wants_keyframe()) {
      const std::optional<Listener> pose = place(frame);
      if (!pose) break;
      auralizer.make_keyframe(*pose);
    }
    auralizer.mix(std::span(all).subspan(b * samples, samples));
  }
  return all;
}

auto always(const Listener& pose) {
  return [pose](std::size_t) { return pose; };
}
// Returns kStart before that block.
auto from(std::size_t block, const Listener& pose) {
  return [block, pose](std::size_t frame) { return frame < block * kBlock ? kStart : pose; };
}
Listener turned(double degrees) {
  return {kStart.position_m, kStartYaw_rad + degrees * kDegrees, 0};
}

std::size_t first_difference(const std::vector<float>& a, const std::vector<float>& b,
                             TurningOutput output) {
  const auto at = std::ranges::mismatch(a, b).in1 - a.begin();
  return static_cast<std::size_t>(at) /
         static_cast<std::size_t>(output_shape_of(output).channels());
}

// Relative RMS difference of the `last` samples.
double difference(std::span<const float> a, std::span<const float> b, std::size_t last) {
  double sum = 0, power = 0;
  for (std::size_t i = a.size() - last; i < a.size(); ++i) {
    sum += (a[i] - b[i]) * (a[i] - b[i]);
    power += b[i] * b[i];
  }
  return std::sqrt(sum / power);
}

class TurningListener : public ::testing::TestWithParam<TurningOutput> {};

// The latency is at most a third of a keyframe plus the HRTF's filters, whatever the sampler does.
// A keyframe alone would take 20 ms and more.
TEST_P(TurningListener, RotatesTheSceneWithinAThirdOfAKeyframe) {
  const TurningOutput output = GetParam();
  const auto still =
      played_blocks(*following_auralizer(output, true), 66, kBlock, always(kStart), always(kStart));
  for (const std::size_t block : {46u, 47u, 48u, 49u}) {  // at any phase of a keyframe
    const auto turns = played_blocks(*following_auralizer(output, true), 66, kBlock, always(kStart),
                                     from(block, turned(20)));
    const std::size_t first = first_difference(still, turns, output);
    EXPECT_GE(first, block * kBlock);
    EXPECT_LE(first, block * kBlock + lead_frames(output) + kThird + kStepFrames);
  }
}

// The result equals that of a listener who has always looked this way, even while the
// sampler keeps the old orientation or stalls. Two receivers assume far sources: an error of 0.3
// frames is 4 % at 997 Hz.
TEST_P(TurningListener, EndsWhereKeyframesWouldHavePutTheScene) {
  const TurningOutput output = GetParam();
  const Listener after = turned(50);
  const auto expected =
      played_blocks(*following_auralizer(output, true), 140, kBlock, always(after), always(after));
  const std::size_t last = expected.size() / 7;
  const double tolerance = output == TurningOutput::kPair ? 0.06 : 0.002;
  const auto turns = played_blocks(*following_auralizer(output, true), 140, kBlock, always(kStart),
                                   from(90, after));
  EXPECT_LT(difference(turns, expected, last), tolerance);
  const auto nobody = [](std::size_t frame) {
    return frame < 80 * kBlock ? std::optional(kStart) : std::nullopt;
  };
  const auto stalls =
      played_blocks(*following_auralizer(output, true), 140, kBlock, nobody, from(90, after));
  EXPECT_LT(difference(stalls, expected, last), tolerance);
  const auto still = played_blocks(*following_auralizer(output, true), 140, kBlock, always(kStart),
                                   always(kStart));
  EXPECT_GT(difference(still, expected, last), 0.1);  // the rotation matters
}

// The rotation is smooth and independent of how blocks and keyframes align: it equals a scripted
// walk, delayed by the latency of head rotation.
TEST_P(TurningListener, RotatesTheSceneSmoothly) {
  const TurningOutput output = GetParam();
  constexpr double kRate = 90 * kDegrees / kSampleRate_hz;
  const auto at = [](double frame) {
    return Listener{kStart.position_m, kStartYaw_rad + kRate * frame, 0};
  };
  const std::size_t later_frames = 2 * kThird + lead_frames(output) / kThird * kThird;
  constexpr std::size_t kBlocks = 150;
  const auto now = [&](std::size_t frame) { return at(static_cast<double>(frame)); };
  const auto turns = played_blocks(*following_auralizer(output, true), kBlocks, kThird, now, now);
  const auto later = [&](double later_by) {
    const auto auralizer = following_auralizer(output, false);
    return played_blocks(
        *auralizer, kBlocks, kThird,
        [&](std::size_t) {
          return at(auralizer->next_keyframe_time_s() * kSampleRate_hz - later_by);
        },
        now);
  };
  const std::size_t last = turns.size() / 2;
  const double error = difference(turns, later(static_cast<double>(later_frames)), last);
  EXPECT_LT(error, 0.01);
  EXPECT_GT(difference(turns, later(static_cast<double>(later_frames + kThird)), last), 2 * error);
}

// The bound is that of Auralizer.StartsAndEndsVoicesWithoutClicks_NoTsan, at 400 degrees per
// second.
TEST_P(TurningListener, CausesNoClickWhenTurningFast) {
  const TurningOutput output = GetParam();
  AuralizerInput input = testing::baked_room(60);
  input.signals.assign(3, testing::sine(200));
  const auto turning = [](std::size_t frame) {
    const auto time_s = static_cast<double>(frame) / kSampleRate_hz;
    return turned(time_s < 0.3 ? 0 : 400 * (time_s - 0.3));
  };
  const auto auralizer = following_auralizer(output, true, input);
  const auto channels = static_cast<std::size_t>(auralizer->channels());
  const auto out = played_blocks(*auralizer, 300, kBlock, turning, turning);
  float height = 0, bend = 0;
  for (std::size_t i = 2 * channels; i < out.size(); i += channels) {
    height = std::max(height, std::abs(out[i]));
    bend = std::max(bend, std::abs(out[i] - 2 * out[i - channels] + out[i - 2 * channels]));
  }
  EXPECT_GT(height, 0.01f);
  EXPECT_LT(bend, 0.005f * height);
}

// The next keyframe contains a step of the listener; it is made one block and the sampler's reserve
// before it is due.
TEST_P(TurningListener, HearsItsOwnStepInTheNextKeyframe) {
  const TurningOutput output = GetParam();
  const auto still =
      played_blocks(*following_auralizer(output, true), 66, kBlock, always(kStart), always(kStart));
  const auto reserve = static_cast<std::size_t>(KeyframeLead::kMinReserve_s * kSampleRate_hz);
  for (const std::size_t block : {46u, 47u, 48u, 49u}) {
    Listener after = kStart;
    after.position_m.x += 0.2;
    const auto steps = played_blocks(*following_auralizer(output, true), 66, kBlock,
                                     from(block, after), always(kStart));
    const std::size_t first = first_difference(still, steps, output);
    EXPECT_GE(first, block * kBlock);
    EXPECT_LE(first, block * kBlock + lead_frames(output) + kKeyframeFrames + reserve + 2 * kBlock);
  }
}

std::string name_of(const ::testing::TestParamInfo<TurningOutput>& given) {
  return given.param == TurningOutput::kPair           ? "Pair"
         : given.param == TurningOutput::kLoudspeakers ? "Loudspeakers"
                                                       : "Hrtf";
}

INSTANTIATE_TEST_SUITE_P(Through, TurningListener,
                         ::testing::Values(TurningOutput::kPair, TurningOutput::kLoudspeakers,
                                           TurningOutput::kHead),
                         name_of);

}  // namespace
}  // namespace clamor
