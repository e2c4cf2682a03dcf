#include "runtime/mixing/voice_kernel.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "common/listener.h"
#include "tests/runtime/hrtf_mixing.h"
#include "tests/runtime/instruction_sets.h"
#include "tests/runtime/varied_sources.h"

namespace clamor {
namespace {

using testing::KernelGuard;
using testing::SourcesOfAllKinds;

// Voices of all kinds of sources, half of them occluded in part.
class Voices {
 public:
  static constexpr std::uint32_t kCount = SourcesOfAllKinds::kCount;

  Voices() : sources_(listener().centre_m), table_(sources_.radiation(), kCount) {
    for (std::uint32_t i = 0; i < kCount; ++i) {
      slots_.push_back(i);
      table_.put(i, sources_[i], 0);
      table_.radiation.scale[i] = static_cast<float>(1 + 100 * SourcesOfAllKinds::at(i, 20));
      for (std::uint32_t b = 0; b < kBandCount; ++b)
        table_.radiation.power_gain[i][b] = static_cast<float>(SourcesOfAllKinds::at(i, 30 + b));
    }
  }

  static ListenerFrame listener(int places = kEars) {
    const Listener pose{{7.25, 1.5, -3}, 0.7, 0.2};
    const Vec3 side_m = places == 1 ? Vec3(0) : 0.085 * pose.right();
    return {pose.position_m, {pose.position_m - side_m, pose.position_m + side_m},
            pose.forward(),  -pose.right(),
            pose.up(),       places};
  }

  std::vector<Voice> made(int places, const ItdTable* itd_table = nullptr) {
    std::vector<Voice> made(kCount);
    place_voices(table_, listener(places), itd_table, 0,
                 (kCount + VoiceTable::kTile - 1) / VoiceTable::kTile * VoiceTable::kTile);
    make_voices(table_, places, slots_, made.data());
    return made;
  }

  const SourcesOfAllKinds& sources() const { return sources_; }
  const VoiceTable& table() const { return table_; }

 private:
  SourcesOfAllKinds sources_;
  VoiceTable table_;
  std::vector<std::uint32_t> slots_;
};

TEST(VoiceKernel, EqualsTheRadiationModelOnEveryInstructionSet) {
  const KernelGuard guard;
  Voices voices;
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    for (const int places : {kEars, 1}) {
      const ListenerFrame stance = Voices::listener(places);
      const auto made = voices.made(places);
      double worst = 0, worst_frames = 0;
      std::size_t heard = 0;
      for (std::size_t i = 0; i < made.size(); ++i)
        for (int e = 0; e < kEars; ++e) {
          const Vec3& ear_m = stance.ear_positions_m[e];
          const Bands intensity = voices.sources().exactly(i, ear_m);
          const Bands& power_gain = voices.table().radiation.power_gain[i];
          Bands expected;
          float loudest = 0;
          for (std::size_t b = 0; b < kBandCount; ++b) {
            expected[b] =
                std::sqrt(intensity[b] * voices.table().radiation.scale[i] * power_gain[b]) *
                static_cast<float>(voices.sources()[i].polarity);
            loudest = std::max(loudest, std::abs(expected[b]));
          }
          heard += loudest > 0;
          for (std::size_t b = 0; b < kBandCount; ++b) {
            const double error = std::abs(made[i].gain[e][b] - expected[b]);
            // The tolerance is 0.001 dB of a band, or 100 dB below the loudest band.
            worst = std::max(worst, error / (1e-4 * std::abs(static_cast<double>(expected[b])) +
                                             1e-5 * static_cast<double>(loudest) + 1e-18));
          }
          const double frames =
              voices.sources().radiation().delay_s(voices.sources()[i], ear_m) * kSampleRate_hz;
          worst_frames = std::max(worst_frames, std::abs(made[i].delay_frames[e] - frames));
        }
      EXPECT_LT(worst, 1) << target << ", " << places << " places";
      EXPECT_LT(worst_frames, 1e-6) << target;
      EXPECT_GT(heard, Voices::kCount);
      EXPECT_LT(heard, 2 * Voices::kCount);  // some radiate away from the listener
    }
  }
}

TEST(VoiceKernel, GivesTheSameBitsOnEveryInstructionSet) {
  const KernelGuard guard;
  Voices voices;
  const ItdTable itd_table(testing::kemar_head());
  for (const int places : {kEars, 1}) {
    force_mix_kernel("");
    const auto expected = voices.made(places, &itd_table);
    for (const std::string& target : mix_kernel_targets()) {
      force_mix_kernel(target);
      const auto made = voices.made(places, &itd_table);
      std::size_t differ = 0;
      for (std::size_t i = 0; i < made.size(); ++i)
        differ += made[i].gain != expected[i].gain || made[i].from != expected[i].from ||
                  made[i].delay_frames != expected[i].delay_frames;
      EXPECT_EQ(differ, 0u) << target;
    }
  }
}

TEST(VoiceKernel, GivesOneVoiceTheDelaysOfABatch) {
  const KernelGuard guard;
  Voices voices;
  const ItdTable itd_table(testing::kemar_head());
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    for (const int places : {kEars, 1}) {
      const auto made = voices.made(places, &itd_table);
      for (std::size_t i = 0; i < made.size(); ++i)
        for (int e = 0; e < kEars; ++e)
          ASSERT_EQ(made[i].delay_frames[e],
                    delay_frames(voices.table(), Voices::listener(places), &itd_table,
                                 {voices.sources()[i].position_m},
                                 voices.table().geometry.emission_frames[i], e))
              << target << i;
    }
  }
}

}  // namespace
}  // namespace clamor
