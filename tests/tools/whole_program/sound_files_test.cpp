// Tests the sample formats, channels and contents of the files that render and play write.
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "formats/audio/audio_file.h"
#include "tests/tools/drawn_page.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;
using testing::read;

// Header of a sound file, read byte by byte.
struct Header {
  std::string kind;  // "pcm", "float" or "flac"
  unsigned channels = 0, bits = 0, rate_hz = 0, speakers = 0;
};

std::uint32_t little(const std::string& bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count && at + i < bytes.size(); ++i)
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << 8 * i;
  return value;
}

Header header_of(const std::string& path) {
  const std::string bytes = read(path);
  Header header;
  if (bytes.starts_with("fLaC")) {
    // STREAMINFO: 20 bits of rate, 3 of channels - 1, 5 of bits - 1, after 18 bytes.
    std::uint32_t packed = 0;
    for (std::size_t i = 18; i < 22; ++i)
      packed = packed << 8 | static_cast<unsigned char>(bytes.at(i));
    return {"flac", (packed >> 9 & 7) + 1, (packed >> 4 & 31) + 1, packed >> 12, 0};
  }
  const std::size_t format = bytes.find("fmt ");
  if (!bytes.starts_with("RIFF") || format == std::string::npos) return header;
  std::uint32_t tag = little(bytes, format + 8, 2);
  header.channels = little(bytes, format + 10, 2);
  header.rate_hz = little(bytes, format + 12, 4);
  header.bits = little(bytes, format + 22, 2);
  if (tag == 0xfffe) {
    header.speakers = little(bytes, format + 28, 4);
    tag = little(bytes, format + 32, 2);
  }
  header.kind = tag == 1 ? "pcm" : tag == 3 ? "float" : "unknown";
  return header;
}

class SoundFiles : public ::testing::Test {
 protected:
  SoundFiles() : bake_(folder_ / "void.clamor") {
    const auto level = folder_.write("void.gltf", testing::kEmptyLevel);
    const auto outcome = clamor({"bake", level, "-o", bake_, "--emitter",
                                 "name=hiss,signal=noise,at=0,0,0,facing=0,0,1,gain=-12dB"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
  }

  // Runs `render` or `play` with output to a file in the folder.
  std::string written(const std::string& command, const std::string& name,
                      const std::vector<std::string>& options) const {
    const std::string path = folder_ / name;
    std::vector<std::string> arguments{command, bake_, "--listener", "1,0,2", "--seconds", "0.25"};
    if (command == "render")
      arguments.insert(arguments.end(), {"-o", path});
    else
      arguments.insert(arguments.end(), {"--device", "none", "--record", path});
    arguments.insert(arguments.end(), options.begin(), options.end());
    const auto outcome = clamor(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return path;
  }

  const Folder folder_;
  const std::string bake_;
};

TEST_F(SoundFiles, HoldTheSamplesThatWereAskedForFromRenderAndPlay) {
  const struct {
    const char *file, *format, *kind;
    unsigned bits;
    double step;  // quantization step of the file
  } cases[] = {{"a.wav", "float", "float", 32, 0},    {"a.wav", "32", "pcm", 32, 0x1p-31},
               {"a.wav", "24", "pcm", 24, 0x1p-23},   {"a.wav", "16", "pcm", 16, 0x1p-15},
               {"a.flac", "24", "flac", 24, 0x1p-23}, {"a.flac", "16", "flac", 16, 0x1p-15}};
  const auto exact = read_channels(written("render", "exact.wav", {"--receivers", "omni"}), 2);
  ASSERT_TRUE(exact.ok());
  for (const char* command : {"render", "play"})
    for (const auto& [file, format, kind, bits, step] : cases) {
      const std::string path = written(command, file, {"--receivers", "omni", "--format", format});
      const Header header = header_of(path);
      const std::string what = std::string(command) + " " + file + " " + format;
      EXPECT_EQ(header.kind, kind) << what;
      EXPECT_EQ(header.bits, bits) << what;
      EXPECT_EQ(header.channels, 2u) << what;
      EXPECT_EQ(header.rate_hz, 48000u) << what;
      const auto sound = read_channels(path, 2);
      ASSERT_TRUE(sound.ok()) << what;
      ASSERT_EQ(sound->frames(), exact->frames()) << what;
      if (std::string(command) == "play") continue;  // may be late on a busy machine
      for (std::size_t c = 0; c < 2; ++c)
        for (std::size_t i = 0; i < exact->frames(); ++i)  // rounding, and dither of one step
          ASSERT_NEAR(sound->channels[c][i], exact->channels[c][i],
                      1.5 * step + 2e-7 * std::abs(exact->channels[c][i]))
              << what << ", frame " << i;
    }
}

TEST_F(SoundFiles, AreForHeadphonesUnlessAnotherOutputIsAskedFor) {
  const auto unasked = read(written("render", "a.wav", {}));
  EXPECT_EQ(unasked, read(written("render", "b.wav", {"--headphones"})));
  EXPECT_EQ(unasked, read(written("render", "c.wav", {"--headphones"})));
  EXPECT_EQ(read(written("render", "d.wav", {"--loudspeakers"})),
            read(written("render", "e.wav", {"--receivers", "wide"})));
  EXPECT_EQ(clamor({"render", bake_, "--listener", "0,0,1", "-o", folder_ / "f.wav",
                    "--loudspeakers", "--headphones"})
                .code,
            2);
}

TEST_F(SoundFiles, HaveTheChannelsOfEveryOutputFromRenderAndPlay) {
  const struct {
    std::vector<std::string> options;
    unsigned channels, speakers;
  } cases[] = {{{"--loudspeakers"}, 2, 0},           {{"--headphones"}, 2, 0},
               {{"--layout", "5.1"}, 6, 0x60f},      {{"--layout", "7.1"}, 8, 0x63f},
               {{"--layout", "7.1.4"}, 12, 0x2d63f}, {{"--ambisonics"}, 16, 0}};
  for (const char* command : {"render", "play"})
    for (const auto& [options, channels, speakers] : cases) {
      const std::string path = written(command, "a.wav", options);
      const Header header = header_of(path);
      const std::string what = command + (options.empty() ? "" : " " + options.back());
      EXPECT_EQ(header.channels, channels) << what;
      EXPECT_EQ(header.speakers, speakers) << what;
      const auto sound = read_channels(path, 16);
      ASSERT_TRUE(sound.ok()) << what;
      EXPECT_EQ(sound->frames(), 12000u) << what;
      double energy = 0;
      for (const auto& channel : sound->channels)
        for (const float sample : channel) energy += static_cast<double>(sample) * sample;
      EXPECT_GT(energy, 1e-3) << what;
    }
}

TEST_F(SoundFiles, ComeWithAReportOfWhatWasPlayed) {
  const std::string report = folder_ / "report";
  const auto outcome = clamor({"play", bake_, "--listener", "1,0,2", "--seconds", "0.5", "--device",
                               "none", "--report", report, "--record", folder_ / "heard.wav"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(read(report + "/play.html").find("Spectrogram"), std::string::npos);
  EXPECT_NE(outcome.err.find("LUFS on average"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("CPU, share of one core"), std::string::npos) << outcome.err;
  const std::string figures = read(report + "/play_figures.csv");
  for (const char* figure :
       {"late_callbacks,", "gaps,", "device_latency_ms,", "held_blocks,", "late_keyframes,",
        "bounded_keyframes,", "mean_voices,", "min_voices,", "loudness_lufs,-"})
    EXPECT_NE(figures.find(figure), std::string::npos) << figure << " in\n" << figures;
  // On a busy machine the only voice begins once its sound is decoded.
  const double mean_voices = std::stod(figures.substr(figures.find("mean_voices,") + 12));
  EXPECT_GT(mean_voices, 0);
  EXPECT_LE(mean_voices, 1);
  EXPECT_NE(read(report + "/play_threads.csv").find("sampler,"), std::string::npos);
  if (testing::has_node()) {
    EXPECT_NE(testing::drawn(report + "/play.html").find("<svg"), std::string::npos);
  }
  EXPECT_NE(read(report + "/play.json").find("short_term_lufs"), std::string::npos);
}

}  // namespace
}  // namespace clamor
