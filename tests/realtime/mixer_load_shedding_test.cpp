// mixer_load_shedding_test.cpp: repeated overload: voices are shed, fade and come back, while
// sources move and sounds are streamed from a file. The audio thread makes no system call
// meanwhile.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "common/platform/prefault_code.h"
#include "common/random.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/realtime/prefault_stack.h"
#include "tests/baked_room.h"
#include "tests/realtime/forbidden.h"
#include "tests/sound_device.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::Forbidden;
using testing::SoundDevice;

// Each reading is later than the one before by a fixed time.
struct BusyClock {
  double now_s = 0, takes_s = 0;

  LoadClock clock() {
    return {[](void* self) noexcept {
              auto& busy = *static_cast<BusyClock*>(self);
              return busy.now_s += busy.takes_s;
            },
            this};
  }
};

// A room whose sounds are too long to be kept whole.
std::shared_ptr<const BakeFile> file_of_long_sounds() {
  BakeContents contents = testing::baked_contents(2000);
  for (std::uint32_t s = 0; s < contents.signals.size(); ++s) {
    Signal& signal = contents.signals[s];
    signal.loop = s != 2;
    signal.samples.resize(std::size_t{45} * kSampleRate_hz);
    for (std::uint32_t i = 0; i < signal.samples.size(); ++i)
      signal.samples[i] = static_cast<float>(unit(philox(31, {i, s, 0, 0})[0]) - 0.5);
  }
  return testing::as_file(contents);
}

// Fifty sources that fly in circles; some go, and others take their place.
class Swarm {
 public:
  explicit Swarm(MovingSources& sources) : sources_(sources) {
    for (std::uint32_t i = 0; i < kCount; ++i) handles_.push_back(*sources_.add(at(i, 0)));
    sources_.commit();
  }

  void fly(double t) {
    for (std::uint32_t i = 0; i < kCount; ++i) {
      const MovingSource source = at(i, t);
      if (random_() % 100 == 0) {
        EXPECT_TRUE(sources_.remove(handles_[i]).ok());
        handles_[i] = *sources_.add(source);
      } else {
        EXPECT_TRUE(sources_.move(handles_[i], source.position_m).ok());
      }
    }
    sources_.commit();
  }

  static constexpr std::uint32_t kCount = 50;

 private:
  static MovingSource at(std::uint32_t i, double t) {
    MovingSource source;
    source.position_m = {3 + 2 * std::sin(t + i), 4 + 3 * std::cos(0.7 * t + i), 1.5};
    source.gain = same_in_all_bands(0.2f);
    return source;
  }

  MovingSources& sources_;
  std::vector<MovingHandle> handles_;
  std::minstd_rand random_{4};
};

constexpr std::size_t kMinBlock_frames = 16, kMaxBlock_frames = 2048;  // of a block

AuralizerOptions shedding_options(BusyClock& audio, BusyClock& sampler, bool binaural) {
  AuralizerOptions options;
  options.voices = 300;
  options.adapt = true;
  options.audio_clock = audio.clock();
  options.sampler_clock = sampler.clock();
  options.limit = true;
  options.block_frames = kMaxBlock_frames;
  options.memory_bytes = 1;  // the minimum for sounds, and the first page
  options.moving = {2 * Swarm::kCount, {{.name = "bee", .signal = 1}}};
  if (binaural) {
    options.output = *OutputFormat::from_options(true, "", false);
    options.output.head = *Hrtf::read("");
  }
  return options;
}

class Shedding : public ::testing::TestWithParam<bool> {};

TEST_P(Shedding, AsksTheSystemForNothingWhileVoicesGoAndComeBack) {
  prefault_code();
  prefault_stack();
  // The backoff lasts 4 s; all voices come back within 4 s.
  constexpr double kSeconds = 30, kTurn_s = 15;
  constexpr double kBlocksAreLate_s = 1.5, kKeyframesAreLate_s = 2;  // of each turn
  BusyClock audio, sampler;
  auto auralizer =
      Auralizer::create(file_of_long_sounds(), shedding_options(audio, sampler, GetParam()));
  ASSERT_TRUE(auralizer.ok()) << auralizer.error().message;
  SoundDevice device(std::move(*auralizer), kSampleRate_hz, kMaxBlock_frames);
  Swarm swarm(*device.auralizer().moving());
  const auto listener = [&](double t) {
    swarm.fly(t);
    return Listener{{3 + 2.5 * std::sin(t), 4 + 3.5 * std::cos(t), 1.5}, t, 0.2};
  };

  std::minstd_rand random(2);
  long faults = 0;
  int times_shed = 0, times_back = 0;
  bool shedding = false;
  while (device.time_s() < kSeconds) {
    const double in_turn_s = std::fmod(device.time_s(), kTurn_s);
    sampler.takes_s = in_turn_s < kKeyframesAreLate_s ? 0.05 : 0;
    device.make_keyframes(listener);
    const auto frames = kMinBlock_frames + random() % (kMaxBlock_frames - kMinBlock_frames + 1);
    // Twice as long as the mixed sound, which is a few frames more than requested.
    audio.takes_s = in_turn_s < kBlocksAreLate_s ? 2.0 * (frames + 64) / kSampleRate_hz : 0;
    const long before = testing::page_faults();
    device.call<Forbidden>(frames);
    faults += testing::page_faults() - before;

    const AuralizerStatistics now = device.statistics();
    if (!shedding && now.shed_voices > 0) ++times_shed, shedding = true;
    if (shedding && now.shed_voices == 0 && now.k == now.max_k) ++times_back, shedding = false;
  }
  const AuralizerStatistics played = device.statistics();
  EXPECT_EQ(faults, 0);
  EXPECT_GT(device.energy(), 1);
  EXPECT_GT(device.callbacks(), 1000u);
  EXPECT_GE(times_shed, kSeconds / kTurn_s);
  EXPECT_GE(times_back, kSeconds / kTurn_s);
  EXPECT_GT(played.max_shed_voices, 200u);
  EXPECT_LT(played.min_k, 100u);
  EXPECT_GT(played.late_keyframes, 5u);
  EXPECT_GT(played.sounds.dropped, 0u);
  EXPECT_EQ(played.sounds.failed + played.pages.failed, 0u);
}

INSTANTIATE_TEST_SUITE_P(AudioThread, Shedding, ::testing::Bool(), [](const auto& binaural) {
  return std::string(binaural.param ? "Binaural" : "Stereo");
});

}  // namespace
}  // namespace clamor
