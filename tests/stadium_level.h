// stadium_level.h: a stadium of stands of blocks of fans, as a level and its groups.
//
// Blocks differ only in place, signals and start times, and so do stands. Fans face the pitch,
// differ in level and directivity, and play `signals` sounds. The groups are in an importer's
// order: parents before children, ranges of one list.
#pragma once

#include <cmath>
#include <numbers>
#include <string>

#include "common/random.h"
#include "formats/level/level.h"
#include "formats/level/scene_group.h"

namespace clamor::testing {

// Coordinate frame of a stand or block.
struct Frame {
  Matrix axes{1};
  Vec3 origin_m{};

  Vec3 operator()(const Vec3& place_m) const { return origin_m + axes * place_m; }
};

struct StadiumLevel {
  std::uint32_t fans = 40;  // per block
  std::uint32_t blocks = 6, stands = 4;
  std::uint32_t signals = 5;
  bool ground = false;  // adds a ground that reflects

  Level level{};
  SceneGroups groups{};

  std::size_t count() const { return std::size_t{fans} * blocks * stands; }

  void build() {
    level = {};
    groups.clear();
    level.name = "terraces";
    for (std::uint32_t s = 0; s < signals; ++s) {
      Signal& signal = level.signals.emplace_back();
      signal.name = "song " + std::to_string(s);
      for (int i = 0; i < 9600; ++i)
        signal.samples.push_back(
            static_cast<float>(0.3 * std::sin(2 * std::numbers::pi * (110 << s) * i / 48000.0)));
    }
    for (std::uint32_t stand = 0; stand < stands; ++stand) {
      const std::size_t first = level.emitters.size();
      const Frame frame = turned(2 * std::numbers::pi * stand / stands, {0, 1, 40 + 0.1 * stand});
      for (std::uint32_t block = 0; block < blocks; ++block) add_block(frame, stand, block);
      groups.push_back({first, level.emitters.size(), frame.axes, frame.origin_m});
    }
    if (!ground) return;
    level.materials.resize(1);
    level.materials[0].name = "ground";
    level.materials[0].absorption = same_in_all_bands(0.3f);
    level.materials[0].scattering = same_in_all_bands(1);
    level.mesh.vertices_m = {{-90, 0, -90}, {90, 0, -90}, {90, 0, 90}, {-90, 0, 90}};
    level.mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
    level.mesh.materials = {0, 0};
  }

 private:
  static Frame turned(double yaw_rad, const Vec3& out_m) {
    const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
    const Matrix axes(Vec3(c, 0, -s), Vec3(0, 1, 0), Vec3(s, 0, c));
    return {axes, axes * out_m};
  }

  void add_block(const Frame& stand_frame, std::uint32_t stand, std::uint32_t block) {
    const Frame frame = {stand_frame.axes, stand_frame(Vec3(9.0 * block, 0.5 * block, 0))};
    const std::size_t first = level.emitters.size();
    for (std::uint32_t f = 0; f < fans; ++f) {
      const RandomBits a = philox(1, {f, 1, 0, 0}), b = philox(1, {f, 2, 0, 0});
      Emitter& fan = level.emitters.emplace_back();
      fan.name = "fan #" + std::to_string(f);
      fan.position_m = frame(Vec3(8 * unit(a[0]), 4 * unit(a[1]), 8 * unit(a[2])));
      fan.axis = frame.axes * normalize(Vec3(unit(b[0]) - 0.5, 0.2, -1));
      fan.gain = 0.2 + 0.3 * unit(a[3]);
      fan.directivity = same_in_all_bands(static_cast<float>(f % 3));
      fan.signal = (f % signals + block % 3 + stand) % signals;
      fan.delay_s = 0.2 * unit(b[1]) + 0.01 * ((7 * block + 3) % 10) + 0.001 * stand;
    }
    groups.push_back({first, level.emitters.size(), frame.axes, frame.origin_m});
  }
};

}  // namespace clamor::testing
