// bake_cache.h: what bakes of a level that is being edited keep in memory for the next.
//
// Surfaces and sounds give the same bytes with and without the cache; photons that are re-weighed
// do not (path_cache.h).
//
// Threads: one bake at a time.
#pragma once

#include "bake/path_cache.h"
#include "bake/report/level_report.h"
#include "formats/bake_file/signal_cache.h"

namespace clamor {

struct BakeCache {
  PathCache paths;
  GeometryCache geometry;
  SignalCache signals;
};

}  // namespace clamor
