// hall_file.h: a bake file of a given number of sources on the walls of a hall, for benchmarks of a
// player.
//
// The hall is 20 x 8 x 15 m, or a multiple; its floor has 2000 triangles, and its sound is noise.
// CLAMOR_BAKE=FILE in the environment names a bake to measure instead.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <unistd.h>

#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_writer.h"
#include "tests/source_lists.h"

namespace clamor::testing {

// The file is removed at the end.
struct HallFile {
  explicit HallFile(std::uint32_t sources, float times = 1)
      : path((std::filesystem::temp_directory_path() /
              ("clamor_hall_" + std::to_string(::getpid()) + ".clamor"))
                 .string()) {
    BakeContents bake;
    bake.provenance.tool = "clamor benchmark";
    Signal& noise = bake.signals.emplace_back();
    noise.name = "noise";
    for (std::uint32_t i = 0; i < 5 * kSampleRate_hz; ++i)
      noise.samples.push_back(static_cast<float>(unit(philox(1, {i, 0, 0, 0})[0]) - 0.5));
    bake.emitters = {Emitter{.name = "source", .position_m = {10, 1.7, 12}}};
    bake.materials.resize(1);
    bake.materials[0].name = "wall";
    bake.materials[0].scattering = same_in_all_bands(0.5f);
    for (std::uint32_t i = 0; i < 2000; ++i) {  // a floor in strips
      for (const Vec3f& at :
           {Vec3f(0.01f * i, 0, 0), Vec3f(0.01f * i, 0, 15), Vec3f(0.01f * (i + 1), 0, 15)})
        bake.mesh.vertices_m.push_back(times * at);
      bake.mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
      bake.mesh.materials.push_back(0);
    }
    auto on_walls = wall_sources(sources);
    for (Source& source : on_walls) source.position_m *= times;
    bake.octree = build_octree(std::move(on_walls));
    const auto written = write_bake(path, bake, 2);
    if (!written.ok()) error = written.error().message;
  }
  ~HallFile() { std::filesystem::remove(path); }

  const std::string path;
  std::string error;
};

// Path in CLAMOR_BAKE, or null.
inline const char* bake_to_measure() { return std::getenv("CLAMOR_BAKE"); }

}  // namespace clamor::testing
