// channel_order_test.cpp: which loudspeaker plays which channel: each channel is a constant of its
// own, and a private server's sink, whose loudspeakers are named, is recorded.
#include <gtest/gtest.h>

#include "runtime/output/supervised_output.h"
#include "tests/player/fake_devices.h"
#include "tests/player/pulse.h"

namespace clamor {
namespace {

float constant_of(int channel) { return 0.1f * static_cast<float>(channel + 1); }

OutputCallback constants(int& channels) {
  return {[](void* count, float* output, std::uint32_t frames, bool) noexcept {
            const int of = *static_cast<int*>(count);
            for (std::uint32_t i = 0; i < frames; ++i)
              for (int c = 0; c < of; ++c) *output++ = constant_of(c);
          },
          &channels};
}

template <class Server>
void expect_each_channel_at_its_loudspeaker(int channels) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "sound servers' libraries are not built for ThreadSanitizer";
#endif
  if (const std::string missing = Server::missing(); !missing.empty()) GTEST_SKIP() << missing;
  Server server(channels);
  ASSERT_TRUE(server.ready());
  auto opened = SupervisedOutput::open(sound_devices(), {Server::kDevice, channels, 512},
                                       constants(channels));
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  const std::vector<float> heard = server.heard([&] {
    (*opened)->start();
    ASSERT_TRUE(
        testing::comes_true([&] { return (*opened)->statistics().callbacks.callbacks > 50; }));
  });
  const std::size_t size = static_cast<std::size_t>(channels);
  std::size_t frame = heard.size() / size;  // the last complete one in which there is sound
  while (frame > 0 && heard[(frame - 1) * size] == 0) --frame;
  ASSERT_GT(frame, 0u);
  for (int c = 0; c < channels; ++c)
    EXPECT_NEAR(heard[(frame - 1) * size + static_cast<std::size_t>(c)], constant_of(c), 1e-4) << c;
}

TEST(ChannelOrder, OfPulseAudioIsThatOfWavFiles) {
  expect_each_channel_at_its_loudspeaker<testing::Pulse>(6);
}

TEST(ChannelOrder, OfSevenPointOneInPulseAudioIsThatOfWavFiles) {
  expect_each_channel_at_its_loudspeaker<testing::Pulse>(8);
}

TEST(ChannelOrder, OfAlsaIsMadeThatOfItsLoudspeakers) {
  expect_each_channel_at_its_loudspeaker<testing::Alsa>(6);
}

TEST(ChannelOrder, OfSevenPointOneInAlsaIsMadeThatOfItsLoudspeakers) {
  expect_each_channel_at_its_loudspeaker<testing::Alsa>(8);
}

}  // namespace
}  // namespace clamor
