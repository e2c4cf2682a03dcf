// Tests that clamor bench prints every figure and that the figures are consistent; times are not
// checked.
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "runtime/voices/mix_kernel.h"
#include "tests/tools/run_clamor.h"
#include "tools/bench/mixer_benchmark.h"
#include "tools/bench/openal_voices.h"

namespace clamor {
namespace {

using nlohmann::json;
using testing::clamor;

TEST(Bench, MeasuresEachWayOfMixingAtEachNumberOfVoicesAndWhatStandsBesideIt) {
  const auto outcome = clamor(
      {"bench", "mixer", "--voices", "20,60", "--cpu-seconds", "0.0005", "--runs", "2", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json all = json::parse(outcome.out);
  EXPECT_EQ(all.at("rate_hz"), 48000);
  EXPECT_EQ(all.at("frames"), 256);

  std::map<std::string, std::set<std::string>> kernels;  // mixing modes by instruction set
  std::map<std::string, int> count;
  for (const json& figure : all.at("figures")) {
    const std::string what = figure.at("what");
    const std::string way = figure.at("curve").get<std::string>() + figure.at("delays").dump() +
                            figure.at("bands").dump() + figure.at("output").get<std::string>();
    const double voices = figure.at("real_time_voices");
    EXPECT_GT(voices, 0) << figure;
    EXPECT_LE(figure.at("median_real_time_voices"), voices) << figure;
    ++count[what];
    if (what != "kernel") continue;
    kernels[figure.at("instructions")].insert(way);
    if (figure.at("instructions") != all.at("instructions")) continue;
    // All shares refer to the same peak.
    for (const std::string of : {"multiply_adds", "loads"}) {
      const double done_per_s = voices * 48000 * figure.at(of + "_per_frame").get<double>();
      EXPECT_NEAR(
          figure.at("of_" + of).get<double>() * all.at("peak").at(of + "_per_s").get<double>(),
          done_per_s, 1e-6 * done_per_s)
          << figure;
    }
  }
  const std::size_t targets = mix_kernel_targets().size();
  EXPECT_EQ(count["mixer"], 2 * 10);     // 2 curves x (2 delays x 2 sets of bands + binaural)
  EXPECT_EQ(count["reference"], 2 * 8);  // without binaural modes
  EXPECT_EQ(kernels.size(), targets);
  for (const auto& [instructions, ways] : kernels) EXPECT_EQ(ways.size(), 10u) << instructions;

  // Each mode, and the mode compared with OpenAL Soft at the other number of voices, too.
  const bool has_openal = !all.at("openal").is_null();
  EXPECT_EQ(all.at("profiles").size(), has_openal ? 11u : 10u);
  for (const json& profile : all["profiles"]) {
    EXPECT_EQ(profile.at("voices"), has_openal && profile == all["profiles"][0] ? 20 : 60);
    for (const char* ns :
         {"reading_ns", "ceiling_ns", "still_and_near_ns", "still_ns", "usual_ns", "mixer_ns"})
      EXPECT_GT(profile.at(ns).get<double>(), 0) << profile;
    EXPECT_LT(profile.at("reading_ns"), profile.at("ceiling_ns")) << profile;
  }

  EXPECT_EQ(all.at("fields").size(), 2 * 2u);
  for (const json& field : all["fields"]) {
    EXPECT_GT(field.at("renewal_ns_per_tap_and_ear"), 0) << field;
    EXPECT_GT(field.at("convolution_s_per_signal_and_ear"), 0) << field;
    const double cpu_s = field.at("cpu_s"), taps = field.at("taps");
    EXPECT_NEAR(field.at("real_time_taps").get<double>() * cpu_s, taps, 1e-6 * taps) << field;
  }

  if (!has_openal) return;
  const json& openal = all["openal"];
  // Stereo, and binaural where OpenAL Soft has an HRTF, as Debian's has.
  const bool has_head = openal.at("head") != "";
  EXPECT_EQ(openal.at("figures").size(), has_head ? 4u : 2u);
  for (std::size_t i = 0; i < openal["figures"].size(); ++i) {
    const json& figure = openal["figures"][i];
    EXPECT_EQ(figure.at("output"), i < 2 ? "stereo" : "binaural");
    EXPECT_EQ(figure.at("voices"), i % 2 == 0 ? 20 : 60);
    for (const char* value : {"still", "moving", "times_still", "times_moving"})
      EXPECT_GT(figure.at(value).get<double>(), 0) << figure;
  }
}

// Whoever compares with other figures has to know which OpenAL Soft was measured, and how.
TEST(Bench, NamesTheOpenalSoftThatItMeasured) {
  const OpenalLibrary library = openal_library();
  if (library.version.empty()) GTEST_SKIP() << "built without OpenAL Soft";
  EXPECT_THAT(library.version, ::testing::MatchesRegex("[0-9]+\\.[0-9]+.*"));
  EXPECT_FALSE(library.resampler.empty());
  EXPECT_EQ(library.output_hz, 48000);

  const auto outcome = clamor(
      {"bench", "mixer", "--voices", "20", "--cpu-seconds", "0.0005", "--runs", "1", "--quiet"});
  EXPECT_EQ(outcome.err, "");  // no progress
  EXPECT_THAT(outcome.out, ::testing::HasSubstr("OpenAL Soft " + library.version + " on the same"));
  EXPECT_THAT(outcome.out,
              ::testing::HasSubstr("resampler " + library.resampler +
                                   ", output at\n48000 Hz, HRTF " + library.hrtf_by_default + "."));
}

// Both rows would measure the same if the library gave stereo for binaural.
TEST(Bench, ComparesBinauralMixingWithTheHrtfOfOpenalSoft) {
  std::vector<float> click(4800, 0.0f);
  click[100] = 1;
  const std::vector<OpenalVoices::Voice> right = {{0, 0, 1, 1}};
  if (!OpenalVoices::create({click}, right)) GTEST_SKIP() << "built without OpenAL Soft";
  const auto onset_frames = [&](OpenalOutput output) {
    const auto voices = OpenalVoices::create({click}, right, output);
    std::array<std::ptrdiff_t, 2> at = {-1, -1};
    if (voices == nullptr) return at;
    std::vector<float> block(std::size_t{2} * 1024);
    voices->render(block);
    for (std::size_t ear = 0; ear < 2; ++ear)
      for (std::size_t i = 0; i < 1024 && at[ear] < 0; ++i)
        if (std::abs(block[2 * i + ear]) > 0.02f) at[ear] = static_cast<std::ptrdiff_t>(i);
    return at;
  };
  EXPECT_EQ(onset_frames(OpenalOutput::kStereo)[0], -1);  // panned to the right alone
  const auto [left, near] = onset_frames(OpenalOutput::kBinaural);
  if (near < 0) GTEST_SKIP() << "OpenAL Soft has no HRTF here";
  // Sound takes 0.6 to 0.8 ms round a head.
  EXPECT_GE(left - near, 20);
  EXPECT_LE(left - near, 45);
}

// One row would be unfair if Clamor read its signals by another curve than OpenAL Soft does.
TEST(Bench, ComparesWithTheInterpolationOfOpenalSoft) {
  const MixMode stereo = mode_like_openal("Linear", OpenalOutput::kStereo);
  EXPECT_EQ(stereo.interpolation, Interpolation::kLinear);
  EXPECT_EQ(stereo.delays, 1);
  EXPECT_FALSE(stereo.two_layers());
  EXPECT_EQ(mode_like_openal("Cubic Spline", OpenalOutput::kStereo).interpolation,
            Interpolation::kCubic);
  const MixMode binaural = mode_like_openal("Linear", OpenalOutput::kBinaural);
  EXPECT_TRUE(binaural.head);
  EXPECT_EQ(binaural.interpolation, Interpolation::kLinear);
}

// Counted by hand: linear interpolation takes two neighbours and one multiply-add; each ear takes a
// gain and a sum; the low layer, at a quarter of the rate, is read with a spline for 5 of 8 bands.
TEST(Bench, CountsWhatAFrameOfAVoiceTakes) {
  const VoiceCost line = cost_of({Interpolation::kLinear, 1, false}, 100);
  EXPECT_EQ(line.multiply_adds, 1 + 2 * 2);
  EXPECT_EQ(line.reading, 1);
  EXPECT_EQ(line.loads, 2);
  const VoiceCost bands = cost_of({Interpolation::kCubic, 2, true}, 100);
  EXPECT_EQ(bands.multiply_adds, 2 * (5 + 5 / 4.0) + 2 * 2 * (3 + 5 / 4.0));
  EXPECT_EQ(bands.reading, 2 * (5 + 5 / 4.0));
  EXPECT_EQ(bands.loads, 2 * (4 + 4 / 4.0));
  // A quarter of the voices are mixed in 24 high and 12 low HRTF bands and 14 quadratures.
  MixMode binaural;
  binaural.head = true;
  binaural.narrowband_voices = 25;
  EXPECT_EQ(cost_of(binaural, 100).multiply_adds,
            2 * (5 + 5 / 4.0) + 2 * 2 * (0.75 * (3 + 5 / 4.0) + 0.25 * (24 + (12 + 14) / 4.0)));
}

// A kernel that takes 10 ns per voice and call and 0.1 ns per frame, of which the peak rate would
// need 0.06: a frame takes 10 / 64 + 0.1 in calls of 64 and 10 / 256 + 0.1 in calls of 256.
TEST(Bench, DividesAVoicesTimeByWhatItGoesInto) {
  KernelProfile profile;
  profile.ceiling_ns = 0.06;
  profile.in_steps_ns = 10 / 64.0 + 0.1;
  profile.still_and_near_ns = 10 / 256.0 + 0.1;
  profile.still_ns = profile.still_and_near_ns + 0.02;
  profile.usual_ns = profile.still_ns + 0.03;
  profile.mixer_ns = profile.usual_ns + 0.04;

  EXPECT_NEAR(profile.taking_ns(), 10 / 256.0, 1e-12);
  EXPECT_NEAR(profile.rest_ns(), 0.1 - 0.06, 1e-12);
  EXPECT_NEAR(profile.memory_ns(), 0.02, 1e-12);
  EXPECT_NEAR(profile.sliding_ns(), 0.03, 1e-12);
  EXPECT_NEAR(profile.keyframes_ns(), 0.04, 1e-12);
}

TEST(Bench, SaysHowFarItIsUntilItIsDone) {
  std::vector<double> shares;
  const auto measured =
      measure_mixer({{20}, 0.0005, 2}, [&](double share) { shares.push_back(share); });
  ASSERT_TRUE(measured.ok()) << measured.error().message;
  ASSERT_FALSE(shares.empty());
  for (std::size_t i = 0; i < shares.size(); ++i)
    EXPECT_NEAR(shares[i], static_cast<double>(i + 1) / static_cast<double>(shares.size()), 1e-9);
}

TEST(Bench, PrintsTablesWithARowForEachWayOfMixing) {
  const auto outcome =
      clamor({"bench", "mixer", "--voices", "40", "--cpu-seconds", "0.0005", "--runs", "1"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto rows = [&](const std::string& begins) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = outcome.out.find('\n' + begins, at)) != std::string::npos; ++at)
      ++count;
    return count;
  };
  // One row each for the mixer, the kernel, the reference, the other instruction sets and the
  // profile; binaural modes have no reference. Two modes have a field.
  for (const std::string curve : {"linear", "cubic "}) {
    EXPECT_EQ(rows(curve + " one    full   stereo "), 5u) << outcome.out;
    EXPECT_EQ(rows(curve + " two    full   stereo "), 5u) << outcome.out;
    EXPECT_EQ(rows(curve + " one    eight  stereo "), 5u) << outcome.out;
    EXPECT_EQ(rows(curve + " two    eight  stereo "), curve == "cubic " ? 6u : 5u) << outcome.out;
    EXPECT_EQ(rows(curve + " two    eight  binaural "), curve == "cubic " ? 5u : 4u) << outcome.out;
  }
  EXPECT_NE(outcome.out.find("K=40"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("OpenAL Soft"), std::string::npos) << outcome.out;
}

TEST(Bench, RefusesWhatItCannotTimeWithASentence) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"bench"},
                                             {"bench", "sampler"},
                                             {"bench", "mixer", "--voices", "150,,2000"},
                                             {"bench", "mixer", "--voices", "0"},
                                             {"bench", "mixer", "--voices", "99999999999"},
                                             {"bench", "mixer", "--cpu-seconds", "-1"},
                                             {"bench", "mixer", "--runs", "0"}}) {
    const auto outcome = clamor(words);
    EXPECT_EQ(outcome.code, 2) << words.back();
    EXPECT_TRUE(outcome.err.starts_with("clamor bench: ")) << outcome.err;
    EXPECT_TRUE(outcome.out.empty()) << outcome.out;
  }
}

}  // namespace
}  // namespace clamor
