// supervised_output_test.cpp: whatever a device does, the mixer is called in time, by one thread at
// a time, and never after it may be gone.
#include "runtime/output/supervised_output.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/player/fake_devices.h"

namespace clamor {
namespace {

using testing::comes_true;
using testing::CountingMixer;
using testing::FakeDevices;
using testing::FakeWorld;

class Supervised : public ::testing::Test {
 protected:
  ~Supervised() override {
    // Releases all hanging threads and waits for them, so that no test meets another's.
    world->opening_hangs = world->closing_hangs = false;
    output.reset();
    EXPECT_TRUE(comes_true([&] { return world->open_now == 0; }));
    EXPECT_FALSE(world->stale_sound);
  }

  void open(const std::string& device = "") {
    OutputRequest request;
    request.device = device;
    auto opened =
        SupervisedOutput::open(std::make_shared<FakeDevices>(world), request, mixer->callback());
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    output = std::move(*opened);
  }
  void play() {
    open();
    output->start();
  }
  bool plays() const { return output->statistics().has_device; }

  // The mixer is called for a quarter of a second of sound, and not all at once.
  void expect_time_goes_on() {
    const std::uint64_t before = mixer->frames();
    const auto start = std::chrono::steady_clock::now();
    ASSERT_TRUE(comes_true([&] { return mixer->frames() > before + kSampleRate_hz / 4; }));
    EXPECT_GT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(50));
    EXPECT_FALSE(mixer->was_called_by_two());
  }

  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();
  std::unique_ptr<CountingMixer> mixer = std::make_unique<CountingMixer>();
  std::unique_ptr<SupervisedOutput> output;
};

TEST_F(Supervised, ADeviceThatWorksHearsEveryFrameOnce) {
  play();
  EXPECT_TRUE(plays());
  expect_time_goes_on();
  output->stop();
  // Silence before the gate admits it, every frame in order, silence after.
  float next = 1;
  const auto heard = world->taken();
  for (std::size_t i = 0; i < heard.size(); i += 2) {
    if (heard[i] == 0) continue;
    ASSERT_EQ(heard[i], next);
    next = heard[i] + 1;
  }
  EXPECT_EQ(next, static_cast<float>(mixer->frames() + 1));
  EXPECT_EQ(output->statistics().losses, 0u);
  EXPECT_EQ(output->statistics().hung_closings, 0u);
}

TEST_F(Supervised, ADeviceThatIsUnpluggedAndPluggedInAgainIsFoundAgain) {
  play();
  expect_time_goes_on();
  world->is_there = false;
  world->asks = false;
  ASSERT_TRUE(comes_true([&] { return !plays(); }));
  expect_time_goes_on();
  EXPECT_NE(output->statistics().problem, "");
  EXPECT_GT(output->statistics().without_device_now_s, 0.2);
  world->is_there = true;
  world->asks = true;
  ASSERT_TRUE(comes_true([&] { return plays(); }));
  expect_time_goes_on();
  const OutputStatistics figures = output->statistics();
  EXPECT_EQ(figures.losses, 1u);
  EXPECT_EQ(figures.reopenings, 1u);
  EXPECT_GT(figures.failed_openings, 0u);
  EXPECT_TRUE(figures.opening_problem.starts_with("there is no sound device"))
      << figures.opening_problem;
  EXPECT_GT(figures.longest_without_s, 0.2);
  EXPECT_EQ(figures.without_device_s, figures.longest_without_s);

  // The reason for a new loss is not the reason why it did not open.
  world->says_so = true;
  ASSERT_TRUE(comes_true([&] { return output->statistics().losses == 2; }));
  EXPECT_EQ(output->statistics().opening_problem, figures.opening_problem);
  EXPECT_NE(output->statistics().problem, figures.opening_problem);
}

// Sound resumes in the middle and must not begin with a step.
TEST_F(Supervised, SoundThatComesBackFadesInAndIsWhereTimeIs) {
  play();
  expect_time_goes_on();
  world->says_so = true;
  ASSERT_TRUE(comes_true([&] { return !plays(); }));
  world->taken();
  world->says_so = false;
  ASSERT_TRUE(comes_true([&] { return plays(); }));
  expect_time_goes_on();
  const auto heard = world->taken();
  std::size_t first = 0;
  while (heard[2 * first + 1] == 0) ++first;
  for (std::size_t i = 0; i < 480 - 1; ++i)
    ASSERT_NEAR(heard[2 * (first + i) + 1], -static_cast<float>(i + 1) / 480, 1e-6);
  EXPECT_EQ(heard[2 * (first + 480) + 1], -1);
  EXPECT_GT(heard[2 * (first + 480)], 12000);
}

TEST_F(Supervised, ADeviceThatDoesNotOpenIsTriedAgainWhileTimeGoesOn) {
  world->opens = false;
  play();
  EXPECT_FALSE(plays());
  EXPECT_EQ(output->statistics().problem, "the device is busy");
  expect_time_goes_on();
  ASSERT_TRUE(comes_true([&] { return world->openings > 2; }));
  world->opens = true;
  ASSERT_TRUE(comes_true([&] { return plays(); }));
  expect_time_goes_on();
  EXPECT_EQ(output->statistics().losses, 0u);
  EXPECT_EQ(output->statistics().reopenings, 1u);
}

TEST_F(Supervised, ADeviceThatDoesNotExistIsAnErrorAtOnce) {
  const auto opened = SupervisedOutput::open(std::make_shared<FakeDevices>(world),
                                             {"no such device"}, mixer->callback());
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("'fake: device'"), std::string::npos)
      << opened.error().message;
}

TEST_F(Supervised, ADeviceThatHangsOnOpeningNeitherStopsTimeNorTheEnd) {
  play();
  world->opening_hangs = true;
  world->says_so = true;
  ASSERT_TRUE(comes_true([&] { return world->openings == 2; }));
  expect_time_goes_on();
  EXPECT_EQ(world->openings, 2);  // drivers are never called twice at once
  output->stop();
  const std::uint64_t before = mixer->frames();
  mixer.reset();
  output.reset();
  EXPECT_GT(before, 0u);
  world->opening_hangs = false;  // it opens now, for nobody, and is closed
  EXPECT_TRUE(comes_true([&] { return world->open_now == 0; }));
}

TEST_F(Supervised, ADeviceThatHangsOnClosingIsLeftBehindAndHearsNothingWhenItWakes) {
  play();
  expect_time_goes_on();
  world->closing_hangs = true;
  world->says_so = true;
  ASSERT_TRUE(comes_true([&] { return !plays(); }));
  world->says_so = false;
  ASSERT_TRUE(comes_true([&] { return plays(); }));
  EXPECT_EQ(world->open_now, 2);  // one of them hangs and still calls
  expect_time_goes_on();
  output->stop();  // and hangs as well
  EXPECT_EQ(output->statistics().hung_closings, 2u);
  output.reset();
  mixer.reset();  // a call from now on would read freed memory
  world->closing_hangs = false;
  ASSERT_TRUE(comes_true([&] { return world->open_now == 0; }));
  EXPECT_EQ(world->stale_calls, 2);
  EXPECT_FALSE(world->stale_sound);
}

TEST_F(Supervised, ADeviceThatAsksAsFastAsItCanIsTakenAway) {
  play();
  expect_time_goes_on();
  const std::uint64_t before = mixer->frames();
  world->runs_away = true;
  ASSERT_TRUE(comes_true([&] { return output->statistics().losses == 1; }));
  // At most half a second of sound too early, plus the time that has passed.
  EXPECT_LT(mixer->frames() - before, 3u * kSampleRate_hz);
  world->runs_away = false;
  ASSERT_TRUE(comes_true([&] { return plays(); }));
  expect_time_goes_on();
}

// A device that opens and dies immediately, forever, is retried less and less often.
TEST_F(Supervised, ADeviceThatComesAndGoesIsNotTriedWithoutPause) {
  play();
  world->says_so = true;
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t before = mixer->frames();
  ASSERT_TRUE(comes_true([&] { return world->openings >= 6; }));
  EXPECT_GT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(1500));
  EXPECT_GT(mixer->frames() - before, kSampleRate_hz);
}

TEST_F(Supervised, ADeviceThatComesBackAtAnotherRateIsResampled) {
  play();
  expect_time_goes_on();
  EXPECT_FALSE(output->statistics().resamples);
  world->says_so = true;
  world->rate_hz = 44100;
  ASSERT_TRUE(comes_true([&] { return !plays(); }));
  world->says_so = false;
  ASSERT_TRUE(comes_true([&] { return plays(); }));
  const OutputStatistics figures = output->statistics();
  EXPECT_TRUE(figures.resamples);
  EXPECT_EQ(figures.rate_hz, 44100);
  const std::uint64_t mixed = mixer->frames(), asked = world->frames;
  expect_time_goes_on();
  const double ratio =
      static_cast<double>(mixer->frames() - mixed) / static_cast<double>(world->frames - asked);
  EXPECT_NEAR(ratio, 48000.0 / 44100, 0.1);  // as far as so few blocks tell
}

TEST_F(Supervised, NoneIsAClockThatNobodyMisses) {
  open("none");
  output->start();
  expect_time_goes_on();
  const OutputStatistics figures = output->statistics();
  EXPECT_EQ(figures.device, "none");
  EXPECT_EQ(figures.without_device_s, 0);
  EXPECT_EQ(world->openings, 0);
}

}  // namespace
}  // namespace clamor
