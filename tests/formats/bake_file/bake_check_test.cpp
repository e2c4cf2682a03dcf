#include "formats/bake_file/bake_check.h"

#include <functional>

#include "common/sample_rate.h"
#include "formats/bake_file/bake_contents.h"
#include "tests/formats/bake_examples.h"
#include "tests/sanitized.h"

namespace clamor::testing {
namespace {

// Every field with every kind of invalid value.
TEST(BakeFile, IsReadableIfItWasWritten) {
  using Change = std::function<void(BakeContents&, double)>;
  const auto as = [](auto& field, double x) { field = static_cast<float>(x); };
  const std::vector<Change> changes = {
      [](auto& c, double x) { c.emitters[0].gain = x; },
      [](auto& c, double x) { c.emitters[0].position_m.y = x; },
      [](auto& c, double x) { c.emitters[0].axis.z = x; },
      [](auto& c, double x) { c.emitters[0].delay_s = x; },
      [=](auto& c, double x) { as(c.emitters[0].directivity[3], x); },
      [](auto& c, double x) { c.emitters[0].signal = x > 0 && x < 9 ? 1 : 7; },
      [=](auto& c, double x) { as(c.materials[1].absorption[0], x); },
      [=](auto& c, double x) { as(c.materials[1].phong[7], x); },
      [](auto& c, double x) { c.settings.roulette_exponent = x; },
      [](auto& c, double x) { c.settings.air.humidity_percent = x; },
      [](auto& c, double x) { c.settings.air.pressure_kpa = x; },
      [](auto& c, double x) { c.statistics.mean_free_path_m = x; },
      [=](auto& c, double x) { as(c.statistics.power_emitted[1], x); },
      [=](auto& c, double x) { as(c.statistics.decay.t30_s[1], x); },
      [=](auto& c, double x) { as(c.statistics.decay.error_db, x); },
      [=](auto& c, double x) { as(c.octree.nodes[1].low_m.x, x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].high_m.z, x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].highest_key, x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].power[4], x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].cone_cos, x); },
      [=](auto& c, double x) { as(c.octree.nodes[0].max_delay_s, x); },
      [](auto& c, double x) { c.octree.nodes[0].children[3] = x > 0 ? kNoNode : 0; },
      [](auto& c, double x) { c.octree.nodes[1].source_count = x > 0 && x < 9 ? 0 : 1000; },
      [](auto& c, double x) { c.octree.nodes[1].first_source = x > 0 && x < 9 ? 0 : 1000; },
      [=](auto& c, double x) { as(c.octree.sources[7].position_m.x, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].normal.y, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].mirror.z, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].delay_s, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].power[2], x); },
      [=](auto& c, double x) { as(c.octree.sources[7].patch_radius_m, x); },
      [=](auto& c, double x) { as(c.octree.sources[7].u, x); },
      [](auto& c, double x) { c.octree.sources[7].material = x > 0 && x < 9 ? 1 : 2; },
      [](auto& c, double x) { c.octree.sources[7].emitter = x > 0 && x < 9 ? 0 : 1; },
      [=](auto& c, double x) { as(c.mesh.vertices_m[1].x, x); },
      [](auto& c, double x) { c.mesh.triangles[0][2] = x > 0 && x < 9 ? 3 : 4; },
      [](auto& c, double x) { c.mesh.materials[0] = x > 0 && x < 9 ? 1 : 2; },
      [](auto& c, double x) { c.mesh.materials.resize(x > 0 && x < 9 ? 2 : 1); },
      [=](auto& c, double x) { as(c.signals[0].samples[5], x); },
      [](auto& c, double x) { c.signals[0].samples.resize(x > 0 && x < 9 ? 1 : 0); },
      [](auto& c, double) { c.signals[0].samples.assign(kSampleRate_hz * 25, 0); },  // silence
      [](auto& c, double) { c.signals.clear(); },
      [](auto& c, double) { c.materials.clear(); },
  };
  const std::string path = path_of("property.clamor");
  int tried = 0, written_files = 0, refused = 0;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    for (const double x : {std::nan(""), -HUGE_VAL, -1e30, -1.0, -1e-30, 0.0, 1e-30, 0.5, 1.0, 5.0,
                           2e3, 1e7, 1e10, 1e25, 3e38, 1e300, HUGE_VAL}) {
      if (kSanitized && ++tried % 3 != 0) continue;  // slow
      BakeContents bake = contents();
      changes[i](bake, x);
      const auto done = write_bake(path, bake, 1);
      if (!done.ok()) {
        ++refused;
        EXPECT_NE(done.error().message.find("property.clamor: is not written"), std::string::npos)
            << done.error().message;
        EXPECT_FALSE(std::filesystem::exists(path));
        continue;
      }
      ++written_files;
      EXPECT_TRUE(read_whole(read(path)).ok()) << "change " << i << ", " << x;
      std::filesystem::remove(path);
    }
  }
  EXPECT_GT(written_files, kSanitized ? 66 : 200);
  EXPECT_GT(refused, kSanitized ? 66 : 200);
}

}  // namespace
}  // namespace clamor::testing
