// priority_sampler_sounds_test.cpp: samples while some sounds are not in memory.
#include <algorithm>

#include <gtest/gtest.h>

#include "runtime/sampling/sampler.h"
#include "runtime/streaming/sound_loader.h"
#include "tests/runtime/priority_sample_reference.h"
#include "tests/runtime/weighted_room.h"

namespace clamor {
namespace {

constexpr std::size_t kVoices = 60;
constexpr std::uint32_t kLast = 1;  // the signal that is loaded last

std::map<std::uint64_t, double> reference(const testing::WeightedRoom& room, const Vec3& place,
                                          bool has_last) {
  std::vector<testing::WeightedSource> all;
  for (std::uint32_t i = 0; i < room.sources().size(); ++i)
    if (has_last || room.radiation.signal(room.sources()[i]) != kLast)
      all.push_back({i, room.weight_of(i, place), room.sources()[i].u});
  return testing::reference_sample(std::move(all), kVoices);
}

TEST(PrioritySampler, GivesAllVoicesToSourcesWhoseSoundsAreInMemory) {
  const testing::WeightedRoom room(400);
  std::vector<SignalDescription> shapes;
  for (const Signal& signal : room.input.signals)
    shapes.push_back({signal.samples.size(), signal.loop});
  SoundLoader loader(
      shapes, {}, MixMode{},
      [&](std::size_t signal, std::size_t) -> Result<std::vector<float>> {
        return room.input.signals[signal].samples;
      },
      {100'000'000, true}, 2, 0);
  loader.play({}, std::vector<WantedSound>{{0, 0, 3}, {kLast, 0, 1}, {2, 0, 2}});
  ASSERT_TRUE(loader.load_next() && loader.load_next());

  SourceList list = room.list();
  const auto sampler = make_priority_sampler(room.radiation, room.weights, list, kVoices);
  sampler->set_sounds(&loader);
  // The samples are unbiased as all are, of the sources that can be heard.
  for (int step = 0; step < 20; ++step) {
    const Vec3 place(1 + 0.1 * step, 2 + 0.2 * step, 1.5);
    const auto sample = sampler->sample(place);
    testing::expect_sample(sample, reference(room, place, false), 1e-12);
    EXPECT_EQ(sample.size(), kVoices);
    EXPECT_FALSE(sampler->unheard().empty());
    for (const WantedSound& one : sampler->unheard()) EXPECT_EQ(one.signal, kLast);
  }

  // Once the sound arrives, a listener who stands still hears it, too.
  const Vec3 place(3, 4, 1.5);
  (void)sampler->sample(place);
  while (loader.load_next()) {
  }
  testing::expect_sample(sampler->sample(place), reference(room, place, true), 1e-12);
  EXPECT_TRUE(sampler->unheard().empty());
}

}  // namespace
}  // namespace clamor
