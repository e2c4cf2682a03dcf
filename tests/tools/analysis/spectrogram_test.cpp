#include "tools/analysis/spectrogram.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "common/random.h"
#include "common/sample_rate.h"
#include "tests/tools/drawn_page.h"
#include "tools/analysis/report_page.h"

namespace clamor {
namespace {

// A sine of half the full scale between two times, otherwise silence.
std::vector<float> tone(double frequency_hz, double length_s, double from_s, double to_s) {
  std::vector<float> samples(static_cast<std::size_t>(length_s * kSampleRate_hz));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double t = static_cast<double>(i) / kSampleRate_hz;
    if (t >= from_s && t < to_s)
      samples[i] = static_cast<float>(0.5 * std::sin(2 * std::numbers::pi * frequency_hz * t));
  }
  return samples;
}

double db(double power) { return 10 * std::log10(std::max(power, 1e-20)); }

constexpr double kTone_db = -9.0309;  // a sine of half the full scale: 1/8

TEST(Spectrogram, HasASineInItsThirdOfAnOctaveAsLoudAsItIs) {
  for (std::size_t band = 0; band < kThirdOctaves; ++band) {
    const double frequency_hz = third_octave_hz(static_cast<int>(band));
    SCOPED_TRACE(frequency_hz);
    const auto samples = tone(frequency_hz, 1.5, 0, 1.5);
    for (const bool stereo : {false, true}) {
      Sound sound{{samples}, kSampleRate_hz, {}};
      if (stereo)
        sound.channels.emplace_back(samples.size(),
                                    0.0f);  // the second channel is silent: half the mean power
      const Spectrogram spectrogram = spectrogram_of(sound);
      const auto& powers = spectrogram.power[spectrogram.power.size() / 2];
      const double expected_db = kTone_db - (stereo ? 3.0103 : 0);
      // The window's main lobe is 12 Hz wide, as wide as the third-octave band at 50 Hz.
      EXPECT_NEAR(db(powers[band]), expected_db, frequency_hz > 200 ? 0.01 : 1.5);
      for (std::size_t other = 0; other < kThirdOctaves; ++other) {
        const double apart_hz = std::abs(third_octave_hz(static_cast<int>(other)) - frequency_hz) -
                                0.116 * third_octave_hz(static_cast<int>(other));  // from its edge
        if (other != band) {
          EXPECT_LT(db(powers[other]), expected_db - (apart_hz > 12 ? 45 : 5)) << other;
        }
      }
    }
  }
}

TEST(Spectrogram, ShowsWhenASoundBeginsAndEnds) {
  const Spectrogram spectrogram = spectrogram_of({{tone(1000, 6, 2, 4)}, kSampleRate_hz});
  constexpr std::size_t kBand = 15;
  ASSERT_NEAR(third_octave_hz(kBand), 1000, 1e-9);
  EXPECT_NEAR(spectrogram.length_s, 6, 1e-9);
  for (std::size_t c = 0; c < spectrogram.power.size(); ++c) {
    const double middle_s = (static_cast<double>(c) + 0.5) * spectrogram.column_s;
    constexpr double kReach_s = 8192.0 / kSampleRate_hz;
    const double level_db = db(spectrogram.power[c][kBand]);
    if (middle_s > 2 + kReach_s && middle_s < 4 - kReach_s) {
      EXPECT_NEAR(level_db, kTone_db, 0.01) << middle_s;
    }
    if (middle_s < 2 - kReach_s || middle_s > 4 + kReach_s) {
      EXPECT_LT(level_db, -150) << middle_s;
    }
  }
}

TEST(Spectrogram, HasAllPowerOfANoiseHoweverManyColumns) {
  std::vector<float> noise(20 * kSampleRate_hz);
  for (std::uint32_t i = 0; i < noise.size(); ++i)
    noise[i] = static_cast<float>(unit(philox(5, {i, 0, 0, 0})[0]) - 0.5);
  for (const std::size_t most : {1u, 7u, 200u}) {
    const Spectrogram spectrogram = spectrogram_of({{noise}, kSampleRate_hz}, most);
    ASSERT_LE(spectrogram.power.size(), most);
    double power = 0;
    for (const auto& column : spectrogram.power)
      for (const double band : column)
        power += band / static_cast<double>(spectrogram.power.size());
    // The bands cover 28 Hz to 22.4 kHz of 24 kHz; frames that extend beyond the ends hold less.
    EXPECT_NEAR(db(power), db(1.0 / 12 * 22361 / 24000), 0.1) << most;
  }
}

TEST(Spectrogram, IsAPictureWithNumbersInIt) {
  using namespace testing;
  if (!has_node()) GTEST_SKIP() << "not on this machine: node";
  const Folder folder;
  const auto picture_of = [&](const Spectrogram& heard) {
    ReportPage page("heard", "Heard", "");
    page.spectrogram(heard, "A <b>", "");
    EXPECT_TRUE(page.write(folder.path()).ok());
    return drawn(folder / "heard.html");
  };
  const std::string svg = picture_of(spectrogram_of({{tone(500, 90, 0, 90)}, kSampleRate_hz}));
  for (const char* part : {"A &lt;b&gt;", ">500<",
                           ">16\xe2\x80\xaf"
                           "000<",
                           ">20<", "-9 dB", "time (s)"})
    EXPECT_NE(svg.find(part), std::string::npos) << part;
  EXPECT_LT(svg.size(), 100'000u);
  // Silence and an empty sound give finite numbers.
  for (const std::size_t frames : {0u, 1u, 100'000u}) {
    const std::string dark =
        picture_of(spectrogram_of({{std::vector<float>(frames)}, kSampleRate_hz}));
    EXPECT_EQ(dark.find("NaN"), std::string::npos);
    EXPECT_EQ(dark.find("Infinity"), std::string::npos);
  }
}

}  // namespace
}  // namespace clamor
