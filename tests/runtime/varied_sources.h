// varied_sources.h: sources with edge cases for kernels, and their exact intensities.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/air.h"
#include "common/material.h"
#include "common/random.h"
#include "common/vec.h"
#include "formats/level/emitter.h"
#include "runtime/propagation/radiation_model.h"

namespace clamor::testing {

// Sources in a cube of 20 m. Some are at the listener's place, radiate away from it, or have a
// narrow lobe towards it.
class SourcesOfAllKinds {
 public:
  static constexpr std::uint32_t kCount = 3000;

  explicit SourcesOfAllKinds(const Vec3& listener_m) : emitters_(4), materials_(5) {
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
    radiation_ = std::make_unique<RadiationModel>(emitters_, materials_, Air{});
    for (std::uint32_t i = 0; i < kCount; ++i) {
      Source source;
      source.position_m = Vec3f(20 * at(i, 0), 20 * at(i, 1), 20 * at(i, 2));
      if (i % 50 == 0) source.position_m = Vec3f(listener_m);
      source.normal = direction(i, 3);
      source.mirror = direction(i, 5);
      if (dot(source.mirror, source.normal) < 0) source.mirror = -source.mirror;
      if (i % 3 == 0)
        source.normal = source.mirror =
            normalize(Vec3f(listener_m) - source.position_m + 0.05f * direction(i, 7));
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
    }
  }

  const RadiationModel& radiation() const { return *radiation_; }
  const Source& operator[](std::size_t i) const { return sources_[i]; }

  // In double precision, one band after the other.
  Bands exactly(std::size_t i, const Vec3& place) const {
    return received_intensity(sources_[i], emitters_, radiation_->laws(),
                              radiation_->air_loss_per_m(), place);
  }

  // Random number in [0, 1).
  static double at(std::uint32_t i, std::uint32_t use) {
    return unit(philox(12, {i, use, 0, 0})[0]);
  }

  static Vec3f direction(std::uint32_t i, std::uint32_t use) {
    const double z = 2 * at(i, use) - 1, turn = 6.2832 * at(i, use + 1);
    const double flat = std::sqrt(1 - z * z);
    return Vec3f(Vec3(flat * std::cos(turn), z, flat * std::sin(turn)));
  }

 private:
  std::vector<Emitter> emitters_;
  std::vector<Material> materials_;
  std::unique_ptr<RadiationModel> radiation_;
  std::vector<Source> sources_;
};

}  // namespace clamor::testing
