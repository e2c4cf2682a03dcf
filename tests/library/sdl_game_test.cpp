// sdl_game_test.cpp: the game with SDL 2, built against the installed library and played without a
// screen or a sound device.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "formats/audio/audio_file.h"
#include "tests/library/installed_library.h"

namespace clamor::testing {
namespace {

class SdlGame : public InstalledLibrary {
 protected:
  void SetUp() override {
    if (!has("gcc")) GTEST_SKIP() << "not on this machine: gcc";
    if (!has("pkg-config") || std::system("pkg-config --exists sdl2") != 0)
      GTEST_SKIP() << "not on this machine: SDL 2 (libsdl2-dev, pkg-config)";
  }

  // Built in C by CMake, once. InstalledLibrary also builds it with clang.
  static const std::string& program() {
    static const std::string folder = build(examples(), "sdl", "gcc", "sdl_game");
    static const std::string file = folder + "/sdl_game";
    return file;
  }

  // Plays without a screen, and returns the recording.
  static Sound recorded(const std::string& program, const std::string& arguments) {
    const TemporaryFile wav(".wav");
    run("SDL_VIDEODRIVER=dummy LD_LIBRARY_PATH=" + libraries() + " " + program + " " + arguments +
        " --record " + wav.path());
    auto sound = read_channels(wav.path(), 2);
    EXPECT_TRUE(sound.ok());
    return sound.ok() ? std::move(*sound) : Sound{{{}, {}}, 0, {}};
  }

  // Plays where nothing but the game's sources is heard, from the origin.
  static Sound recorded_in_free_field(const std::string& arguments) {
    return recorded(program(), silent_field() + " 0 0 0 " + arguments);
  }
};

bool is_sound(std::span<const float> samples) {
  return std::ranges::all_of(samples, [](float s) { return std::isfinite(s); }) &&
         std::ranges::any_of(samples, [](float s) { return std::abs(s) > 0.001f; });
}

bool is_sound(const Sound& sound) {
  return is_sound(sound.channels[0]) && is_sound(sound.channels[1]);
}

// The power of a channel between two times.
double power(const Sound& sound, std::size_t channel, double from_s, double to_s) {
  const auto frame = [](double time_s) {
    return static_cast<std::size_t>(std::lround(time_s * kSampleRate_hz));
  };
  double sum = 0;
  for (std::size_t f = frame(from_s); f < frame(to_s); ++f)
    sum += static_cast<double>(sound.channels[channel][f]) * sound.channels[channel][f];
  return sum / static_cast<double>(frame(to_s) - frame(from_s));
}

double db(double power_ratio) { return 10 * std::log10(power_ratio); }

TEST_F(SdlGame, PlaysTheSamplesOfTheProgramWhereItsSourcesAreMuted_NoAsan) {
  const TemporaryFile theirs(".wav"),
      walk(".json", R"({"points":[{"time_s":0,"position_m":[3,4,1.5]},)"
                    R"({"time_s":0.3,"position_m":[2.5,3,1.25]}]})");
  const std::string way =
      room_without_walls() + " 3 4 1.5 --walk 2.5 3 1.25 --seconds 0.3 --loudspeakers ";
  const Sound ours = recorded(program(), way + "--press 12");
  run(std::string(kProgram) + " render " + room_without_walls() + " -o " + theirs.path() +
      " --walk " + walk.path() + " --layout stereo --limiter on");
  const auto rendered = read_channels(theirs.path(), 2);
  ASSERT_TRUE(rendered.ok());
  EXPECT_EQ(ours.frames(), 14'400u);
  EXPECT_TRUE(is_sound(ours));
  EXPECT_EQ(ours.channels, rendered->channels);
  EXPECT_NE(recorded(program(), way + "--press 1").channels, rendered->channels);
}

// The bell's direction is 90 degrees * t to the right of where the listener looks.
TEST_F(SdlGame, IsLouderInTheEarOnTheSideOfTheBell_NoAsan) {
  const Sound heard = recorded_in_free_field("--press 2 --seconds 4");
  ASSERT_TRUE(is_sound(heard));
  for (double t = 0.1; t < 3.9; t += 0.1) {
    const double sine = std::sin(std::numbers::pi / 2 * t);
    const double right_over_left_db =
        db(power(heard, 1, t - 0.05, t + 0.05) / power(heard, 0, t - 0.05, t + 0.05));
    // A head shadows partials of 440 to 1760 Hz by some decibels, and less near its median plane.
    if (std::abs(sine) > 0.4) {
      EXPECT_GT(right_over_left_db * sine, 0.5) << t << " s";
    }
  }
}

TEST_F(SdlGame, LetsTheVoiceFadeWithDistance_NoAsan) {
  const Sound heard = recorded_in_free_field("--walk 0 0 15 --press 1 --loudspeakers");
  ASSERT_TRUE(is_sound(heard));
  // For half a second from each second on, it says "ah". Its sound takes up to 50 ms.
  const auto level = [&](double second) {
    return power(heard, 0, second + 0.1, second + 0.4) +
           power(heard, 1, second + 0.1, second + 0.4);
  };
  const auto expected = [](double second) {
    const double x_m = 1.5 * std::sin(std::numbers::pi / 3 * (second + 0.25));
    const double z_m = 3 + 15 * (second + 0.25) / 4;
    return 1 / (x_m * x_m + z_m * z_m);
  };
  EXPECT_NEAR(db(level(3) / level(0)), db(expected(3) / expected(0)), 0.5);
}

// Two rooms: the walker stands in one, the voice paces in the other.
TEST_F(SdlGame, LetsTheVoiceBeHeardThroughTheDoorThatItOpens_NoAsan) {
  const auto heard = [](const std::string& keys) {
    return recorded(program(),
                    rooms_with_door() + " 4 2 6 --seconds 2 --loudspeakers --press " + keys);
  };
  const Sound closed = heard("1"), open = heard("13");
  ASSERT_TRUE(is_sound(open));
  EXPECT_LT(power(closed, 0, 1.2, 2), 1e-3 * power(open, 0, 1.2, 2));
  EXPECT_LT(power(open, 0, 0, 0.05), 0.1 * power(open, 0, 1.2, 2)) << "it opens within a second";
}

TEST_F(SdlGame, LetsTheVoiceReverberateWhereTheBakeHasProbes_NoAsan) {
  const std::string place = " 4 2 8.9 --seconds 1 --loudspeakers --press 1";
  const Sound room = recorded(program(), rooms_with_door() + place),
              field = recorded(program(), silent_field() + place);
  ASSERT_TRUE(is_sound(field));
  // In the room most of the sound is reflected.
  EXPECT_GT(db(power(room, 0, 0.3, 1) / power(field, 0, 0.3, 1)), 3);
}

TEST_F(SdlGame, IsTheSameInCppByPkgConfig_NoAsan) {
  const std::string arguments = silent_field() + " 0 0 0 --seconds 0.2 --loudspeakers";
  const Sound from_c = recorded(program(), arguments);
  EXPECT_TRUE(is_sound(from_c));
  for (const std::string compiler : {"gcc", "clang"}) {
    if (!has(compiler)) continue;
    const std::string cpp = prefix_ + "/sdl_game_" + compiler;
    run(cxx(compiler) + " -x c++ " + kClientFlags + " " + examples() + "/sdl_game.c -o " + cpp +
        by_pkg_config("clamor sdl2") + "-lm");
    EXPECT_EQ(from_c.channels, recorded(cpp, arguments).channels) << compiler;
  }
}

// SDL's disk driver calls the audio callback as a device would, and keeps what it gets. The game
// ends when it has been heard, however late the first keyframe is.
TEST_F(SdlGame, IsHeardThroughTheAudioThreadOfSdl_NoAsan) {
  const TemporaryFile raw(".raw");
  run("SDL_VIDEODRIVER=dummy SDL_AUDIODRIVER=disk SDL_DISKAUDIOFILE=" + raw.path() +
      " timeout 300 " + program() + " " + room() +
      " 3 4 1.5 --walk 2 4 1.5 --seconds 0.2 --loudspeakers");
  const std::string bytes = raw.bytes();
  std::vector<float> samples(bytes.size() / sizeof(float));
  std::memcpy(samples.data(), bytes.data(), samples.size() * sizeof(float));
  EXPECT_GE(samples.size(), 9600u * 2);
  EXPECT_TRUE(is_sound(samples));
}

}  // namespace
}  // namespace clamor::testing
