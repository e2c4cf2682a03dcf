#include "runtime/mixing/voice_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "common/pose.h"
#include "common/random.h"
#include "formats/level.h"
#include "runtime/voices/mix_kernel.h"
#include "tests/runtime/heads.h"

namespace clamor {
namespace {

struct KernelGuard {
  ~KernelGuard() { force_mix_kernel(""); }
};

// Every kind of source, in a cube of 20 m: some are where the listener is, or look away.
class Sources {
 public:
  static constexpr std::uint32_t kCount = 3000;

  Sources() : emitters_(4), materials_(5) {
    emitters_[1].directivity = same_in_all_bands(1);
    emitters_[2].directivity = {0, 0.5f, 1, 2, 4, 8, 16, 32};
    emitters_[3].directivity = same_in_all_bands(1000);
    emitters_[2].delay_s = 1.25;
    materials_[1].scattering = same_in_all_bands(0.5f);
    materials_[2].scattering = {0, 0.1f, 0.2f, 0.4f, 0.6f, 0.8f, 0.9f, 1};
    materials_[2].phong = {1, 5, 20, 20, 50, 100, 300, 20};
    materials_[3].scattering = same_in_all_bands(0);
    materials_[3].phong = same_in_all_bands(1000);
    materials_[4].scattering = same_in_all_bands(0.1f);
    materials_[4].phong = {0, 20, 20, 20, 0, 20, 20, 0.25f};
    field_ = std::make_unique<SourceField>(emitters_, materials_, Air{});
    table_ = std::make_unique<VoiceTable>(*field_, kCount);
    for (std::uint32_t i = 0; i < kCount; ++i) {
      Source source;
      source.position_m = Vec3f(20 * at(i, 0), 20 * at(i, 1), 20 * at(i, 2));
      if (i % 50 == 0) source.position_m = Vec3f(listener().centre_m);
      source.normal = direction(i, 3);
      source.mirror = direction(i, 5);
      if (dot(source.mirror, source.normal) < 0) source.mirror = -source.mirror;
      // Towards the listener, where narrow lobes are.
      if (i % 3 == 0)
        source.normal = source.mirror =
            normalize(Vec3f(listener().ears_m[0]) - source.position_m + 0.05f * direction(i, 7));
      if (i % 50 == 0) source.mirror = source.normal = {0, 1, 0};
      source.delay_s = static_cast<float>(at(i, 9));
      source.patch_radius_m = i % 7 == 0 ? 2.0f : 0.0f;
      source.polarity = i % 2 == 0 ? 1 : -1;
      source.is_emitter = i % 5 == 0;
      source.emitter = i % 4;
      source.material = static_cast<std::uint16_t>(i / 5 % 5);
      for (std::uint32_t b = 0; b < kBandCount; ++b)
        source.power[b] = static_cast<float>(std::pow(10, -6 * at(i, 10 + b)));
      sources_.push_back(source);
      slots_.push_back(i);
      table_->put(i, source);
      table_->scale[i] = static_cast<float>(1 + 100 * at(i, 20));
      for (std::uint32_t b = 0; b < kBandCount; ++b)
        table_->visibility[i][b] = static_cast<float>(at(i, 30 + b));
    }
  }

  static Stance listener(int places = kEars) {
    const Pose pose{{7.25, 1.5, -3}, 0.7, 0.2};
    const Vec3 side_m = places == 1 ? Vec3(0) : 0.085 * pose.right();
    return {pose.position_m, {pose.position_m - side_m, pose.position_m + side_m},
            pose.forward(),  -pose.right(),
            pose.up(),       places};
  }

  std::vector<Voice> voices(int places, const EarLags* lags = nullptr) {
    std::vector<Voice> made(kCount);
    place_voices(*table_, listener(places), lags, 0,
                 (kCount + VoiceTable::kTile - 1) / VoiceTable::kTile * VoiceTable::kTile);
    make_voices(*table_, places, slots_, made.data());
    return made;
  }

  const SourceField& field() const { return *field_; }
  const VoiceTable& table() const { return *table_; }
  const Source& operator[](std::size_t i) const { return sources_[i]; }

 private:
  static double at(std::uint32_t i, std::uint32_t use) {
    return unit(philox(12, {i, use, 0, 0})[0]);
  }
  static Vec3f direction(std::uint32_t i, std::uint32_t use) {
    const double z = 2 * at(i, use) - 1, turn = 6.2832 * at(i, use + 1);
    const double flat = std::sqrt(1 - z * z);
    return Vec3f(Vec3(flat * std::cos(turn), z, flat * std::sin(turn)));
  }

  std::vector<Emitter> emitters_;
  std::vector<Material> materials_;
  std::unique_ptr<SourceField> field_;
  std::unique_ptr<VoiceTable> table_;
  std::vector<Source> sources_;
  std::vector<std::uint32_t> slots_;
};

TEST(VoiceKernel, GivesWhatTheFieldSaysOnEveryInstructionSet) {
  const KernelGuard guard;
  Sources sources;
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    for (const int places : {kEars, 1}) {
      const Stance stance = Sources::listener(places);
      const auto voices = sources.voices(places);
      double worst = 0, worst_frames = 0;
      std::size_t heard = 0;
      for (std::size_t i = 0; i < voices.size(); ++i)
        for (int e = 0; e < kEars; ++e) {
          const Vec3& ear_m = stance.ears_m[e];
          const Bands intensity = sources.field().intensity(sources[i], ear_m);
          const Bands& visibility = sources.table().visibility[i];
          Bands expected;
          float loudest = 0;
          for (std::size_t b = 0; b < kBandCount; ++b) {
            expected[b] = std::sqrt(intensity[b] * sources.table().scale[i] * visibility[b]) *
                          static_cast<float>(sources[i].polarity);
            loudest = std::max(loudest, std::abs(expected[b]));
          }
          heard += loudest > 0;
          for (std::size_t b = 0; b < kBandCount; ++b) {
            const double error = std::abs(voices[i].gain[e][b] - expected[b]);
            // 0.001 dB of itself, or 100 dB below the loudest band.
            worst = std::max(worst, error / (1e-4 * std::abs(static_cast<double>(expected[b])) +
                                             1e-5 * static_cast<double>(loudest) + 1e-18));
          }
          const double frames = sources.field().delay_s(sources[i], ear_m) * kSampleRate_hz;
          worst_frames = std::max(worst_frames, std::abs(voices[i].delay_frames[e] - frames));
        }
      EXPECT_LT(worst, 1) << target << ", " << places << " places";
      EXPECT_LT(worst_frames, 1e-6) << target;
      EXPECT_GT(heard, Sources::kCount);
      EXPECT_LT(heard, 2 * Sources::kCount);  // some look away
    }
  }
}

TEST(VoiceKernel, GivesTheSameBitsOnEveryInstructionSet) {
  const KernelGuard guard;
  Sources sources;
  const EarLags lags(testing::kemar_head());
  for (const int places : {kEars, 1}) {
    force_mix_kernel("");
    const auto expected = sources.voices(places, &lags);
    for (const std::string& target : mix_kernel_targets()) {
      force_mix_kernel(target);
      const auto voices = sources.voices(places, &lags);
      std::size_t differ = 0;
      for (std::size_t i = 0; i < voices.size(); ++i)
        differ += voices[i].gain != expected[i].gain || voices[i].from != expected[i].from ||
                  voices[i].delay_frames != expected[i].delay_frames;
      EXPECT_EQ(differ, 0u) << target;
    }
  }
}

TEST(VoiceKernel, GivesTheDelaysOfOneVoiceAsOfMany) {
  const KernelGuard guard;
  Sources sources;
  const EarLags lags(testing::kemar_head());
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    for (const int places : {kEars, 1}) {
      const auto voices = sources.voices(places, &lags);
      for (std::size_t i = 0; i < voices.size(); ++i)
        for (int e = 0; e < kEars; ++e)
          ASSERT_EQ(voices[i].delay_frames[e],
                    delay_frames(sources.table(), Sources::listener(places), &lags,
                                 sources[i].position_m, sources.table().leaves_frames[i], e))
              << target << i;
    }
  }
}

// The table is as good as the triangles it was made from, but for a ring: a third of the sphere's
// height, below which KEMAR was not measured, where triangles are slivers and lags bend within less
// than a cell.
TEST(EarLags, AreTheHeadsWithinAMicrosecondNearlyEverywhere) {
  const Head& head = testing::kemar_head();
  const EarLags lags(head);
  constexpr std::uint32_t kDirections = 20'000;
  constexpr double kMicrosecond_frames = 1e-6 * kSampleRate_hz;
  constexpr double kMeasuredFrom = -0.64;
  double worst_frames = 0, worst_below_frames = 0;
  std::size_t beyond = 0;
  for (std::uint32_t i = 0; i < kDirections; ++i) {
    const double z = 2 * (i + 0.5) / kDirections - 1, turn = 2.399963 * i;
    const double flat = std::sqrt(1 - z * z);
    const Vec3f from(Vec3(flat * std::cos(turn), flat * std::sin(turn), z));
    const double expected = head.delay_frames(from, 1) - head.delay_frames(from, 0);
    const double error = std::abs(static_cast<double>(lags(from)) - expected);
    if (z > kMeasuredFrom) worst_frames = std::max(worst_frames, error);
    worst_below_frames = std::max(worst_below_frames, error);
    beyond += error > kMicrosecond_frames;
  }
  EXPECT_LT(static_cast<double>(beyond) / kDirections, 0.015);
  EXPECT_LT(worst_frames, 10 * kMicrosecond_frames);
  EXPECT_LT(worst_below_frames, 30 * kMicrosecond_frames);
}

}  // namespace
}  // namespace clamor
