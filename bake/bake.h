// bake.h: from a level to the contents of a bake file.
//
//   Level -> Scene (Embree) -> photons -> SecondarySource[] -> patch radii -> SourceOctree
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "common/result.h"
#include "formats/bake_file.h"
#include "formats/level.h"

namespace clamor {

struct BakeProgress {
  const char* stage = "";
  std::uint64_t photons_done = 0, photons_total = 0, bounces = 0;
};

struct BakeOptions {
  BakeSettings settings{};
  int threads = 0;                                         // 0: all cores; never changes a byte
  std::function<void(const BakeProgress&)> on_progress{};  // from any thread, one at a time
  const std::atomic<bool>* stop = nullptr;                 // set it to end the bake with an Error
};

// Traces the level. provenance.tool and statistics are filled in; provenance.level and input_hash
// are the caller's. A level without triangles is a free field; one without emitters is an Error.
Result<BakeContents> bake(const Level& level, const BakeOptions& options);

}  // namespace clamor
