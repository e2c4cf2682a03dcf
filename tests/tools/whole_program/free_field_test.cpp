// Tests the free field through the whole program, the first thing an acoustician would try.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "common/air.h"
#include "common/sample_rate.h"
#include "formats/audio/audio_file.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;

// Reading averages both ears, which are at the same distance for a listener who faces the source.
std::vector<float> rendered(const std::string& bake, const std::string& wav, double distance_m,
                            const std::string& strategy = "priority",
                            const std::string& receivers = "omni") {
  // The ears are 0.17 m apart, so the head is a little nearer than the ears.
  const double head_m = std::sqrt(distance_m * distance_m - 0.085 * 0.085);
  const auto outcome =
      clamor({"render", bake, "-o", wav, "--listener", "0,0," + std::to_string(head_m), "--seconds",
              "0.5", "--strategy", strategy, "--receivers", receivers});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  auto samples = read_audio(wav);
  EXPECT_TRUE(samples.ok());
  return samples.ok() ? *samples : std::vector<float>(24000);
}

// Amplitude and delay (in frames, from the phase) of one frequency of an impulse response.
struct Component {
  double amplitude, phase;
};
Component at(const std::vector<float>& samples, double frequency_hz) {
  double re = 0, im = 0;
  for (std::size_t n = 0; n < samples.size(); ++n) {
    const double angle =
        2 * std::numbers::pi * frequency_hz * static_cast<double>(n) / kSampleRate_hz;
    re += samples[n] * std::cos(angle);
    im -= samples[n] * std::sin(angle);
  }
  return {std::hypot(re, im), std::atan2(im, re)};
}

class FreeField : public ::testing::Test {
 protected:
  FreeField() : bake_(folder_ / "void.clamor"), wav_(folder_ / "out.wav") {
    const auto level = folder_.write("void.gltf", testing::kEmptyLevel);
    const auto outcome = clamor({"bake", level, "-o", bake_, "--emitter",
                                 "name=click,signal=impulse,at=0,0,0,facing=0,0,1"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
  }

  const Folder folder_;
  const std::string bake_, wav_;
};

TEST_F(FreeField, LevelFallsBySixDecibelsPerDoublingAndSoundTakesItsTime) {
  const Air air;
  for (const double distance_m : {1.0, 2.0, 4.0, 8.0}) {
    const auto samples = rendered(bake_, wav_, distance_m);
    const double expected_frames = distance_m / speed_of_sound_mps(air) * kSampleRate_hz;
    for (const double frequency_hz : {250.0, 500.0, 1000.0}) {
      const Component heard = at(samples, frequency_hz);
      const double air_db = 10 / std::log(10) * air_loss_per_m(air, frequency_hz) * distance_m;
      EXPECT_NEAR(20 * std::log10(heard.amplitude), -20 * std::log10(distance_m) - air_db, 0.03)
          << distance_m << " m, " << frequency_hz << " Hz";
      // The phase gives the delay modulo a period, which is 48 frames or more.
      const double period_frames = kSampleRate_hz / frequency_hz;
      const double delay_frames = -heard.phase / (2 * std::numbers::pi) * period_frames;
      EXPECT_NEAR(std::remainder(delay_frames - expected_frames, period_frames), 0, 0.1)
          << distance_m << " m, " << frequency_hz << " Hz";
    }
    // This identifies the period.
    const auto peak = std::max_element(samples.begin(), samples.end(),
                                       [](float a, float b) { return std::abs(a) < std::abs(b); });
    EXPECT_NEAR(static_cast<double>(peak - samples.begin()), expected_frames, 1.01);
  }
}

TEST_F(FreeField, AllSourcesAndTheSampleOfThemAreTheSameWhenThereIsOnlyOne) {
  const auto priority = rendered(bake_, wav_, 2);
  EXPECT_EQ(priority, rendered(bake_, wav_, 2, "all"));
}

TEST_F(FreeField, ReachesACardioidPairAsFarOffItsAxesAsItIs) {
  const auto omni = rendered(bake_, wav_, 8), pair = rendered(bake_, wav_, 8, "priority", "ortf");
  const double off_axis = 55 * std::numbers::pi / 180;  // plus or minus 0.6 degrees
  EXPECT_NEAR(at(pair, 500).amplitude / at(omni, 500).amplitude,
              std::sqrt(3.0) * (1 + std::cos(off_axis)) / 2, 0.01);  // sqrt 3: as loud in all
  const auto outcome =
      clamor({"render", bake_, "-o", wav_, "--listener", "0,0,1", "--receivers", "ears"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("there are 'omni', 'ortf' and 'wide'"), std::string::npos)
      << outcome.err;
}

TEST_F(FreeField, RendersTheSameBytesEachTime) {
  rendered(bake_, wav_, 3);
  const std::string first = testing::read(wav_);
  rendered(bake_, wav_, 3);
  EXPECT_TRUE(first == testing::read(wav_));
}

TEST_F(FreeField, SaysThatMovingSourcesHaveNoProbesToReverberateThrough) {
  const auto err_of = [&](const std::string& reverberation) {
    const std::string script = folder_.write(
        "script.json", R"({"sources": [{"signal": "noise", )" + reverberation +
                           R"("path": {"points": [{"time_s": 0, "position_m": [1, 0, 2]}]}}]})");
    const auto outcome = clamor({"render", bake_, "-o", wav_, "--listener", "0,0,1", "--seconds",
                                 "0.1", "--moving", script});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.err;
  };
  EXPECT_NE(err_of("").find("bake with --probes auto"), std::string::npos);
  EXPECT_EQ(err_of(R"("reverberation_db": -200, )").find("probes"), std::string::npos);
}

TEST_F(FreeField, StrengthReTenMetresIsTheInverseSquareLaw) {
  const Air air;
  for (const double distance_m : {2.0, 10.0, 20.0}) {
    const auto outcome =
        clamor({"impulse", bake_, "--listener", "0,0," + std::to_string(distance_m), "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto json = nlohmann::json::parse(outcome.out);
    const Bands loss = air_loss_per_m(air);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double expected_db =
          20 * std::log10(10 / distance_m) - 10 / std::log(10) * loss[b] * distance_m;
      EXPECT_NEAR(json["energy"]["g_db"][b].get<double>(), expected_db, 0.01) << "band " << b;
      // The waveform's octave filters see the slope of the air across the band.
      EXPECT_NEAR(json["waveform"]["g_db"][b].get<double>(), expected_db, 0.3) << "band " << b;
      EXPECT_TRUE(json["energy"]["t30_s"][b].is_null());  // a single arrival has no decay
    }
  }
}

// The travel time of 49 minutes once took 12 GB.
TEST_F(FreeField, At1000KilometresTheImpulseBeginsWithTheArrival) {
  const auto measured =
      clamor({"impulse", bake_, "-o", wav_, "--listener", "0,0,1000000", "--json"});
  ASSERT_EQ(measured.code, 0) << measured.err;
  EXPECT_NE(measured.err.find("The sound travels for 29"), std::string::npos) << measured.err;
  // Air takes about 100 dB of the lowest octave.
  const double g_db = nlohmann::json::parse(measured.out)["energy"]["g_db"][0].get<double>();
  EXPECT_NEAR(g_db, -100 - 10 / std::log(10) * air_loss_per_m(Air{})[0] * 1e6, 0.1);
  const auto samples = read_audio(wav_);
  ASSERT_TRUE(samples.ok());
  EXPECT_LT(samples->size(), 10'000u);
}

}  // namespace
}  // namespace clamor
