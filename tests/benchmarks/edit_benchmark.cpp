// edit_benchmark.cpp: what the first bake after an edit costs, which decides how soon the edit is
// heard in `clamor view`.
//
// The absorption of a level's first material goes back and forth by a tenth. Four ways to bake:
//
//   alone       a quick bake that knows nothing of those before
//   cached      a quick bake with the surfaces and sounds of those before (bake_cache.h)
//   reweighed   with their photons as well, re-weighed (path_cache.h)
//   as_many     with the surfaces and sounds, tracing as many photons as are re-weighed
//
// Counters, as means: cpu_ms, CPU time of all threads; error_db, the standard error of the energy
// decay; photons; kB of the paths. CLAMOR_LEVEL=FILE takes another level than the violin room; one
// without emitters gets noise at (0, 1.5, 0).
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <benchmark/benchmark.h>

#include "bake/bake_cache.h"
#include "bake/bake_observer.h"
#include "bake/level_bake.h"
#include "common/cpu_time.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/gltf/level_import.h"
#include "tests/build_paths.h"

namespace clamor {
namespace {

// A level beside whose sidecar nothing is written: that of an edit lies in a temporary file.
class EditedRoom {
 public:
  EditedRoom() {
    const char* const level = std::getenv("CLAMOR_LEVEL");
    request_.level_path = level != nullptr
                              ? level
                              : std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb";
    const auto imported = import_level(request_.level_path, {});
    if (!imported.ok()) {
      error = imported.error().message;
      return;
    }
    if (imported->level.emitters.empty())
      request_.import.emitters = {"name=hiss,signal=noise,at=0,1.5,0"};
    material_ = imported->level.materials[0];
    sidecar_ = (std::filesystem::temp_directory_path() / "clamor_edit_benchmark.json").string();
    request_.import.sidecar = sidecar_;
  }
  ~EditedRoom() {
    std::error_code none;
    std::filesystem::remove(sidecar_, none);
  }

  // Changes the absorption and bakes as the first or the second stage of `clamor view`.
  bool bake(bool is_quick, bool is_more, BakeCache* cache, bool reweighs) {
    std::string list;
    for (const float absorption : material_.absorption)
      list += (list.empty() ? "" : ", ") +
              std::to_string(std::min(0.99f, absorption * (is_more ? 1.1f : 1.0f)));
    std::ofstream(sidecar_) << R"({"materials": {")" << material_.name << R"(": {"absorption": [)"
                            << list << R"(], "scattering": )" << material_.scattering[3] << "}}}";
    BakeRequest wanted = request_;
    wanted.photons = is_quick && !traces_more ? "1000" : "12000";
    wanted.sources = is_quick ? "15000" : "80000";
    LevelBakeOptions options;
    options.output = sidecar_ + ".clamor";
    options.journal = "";
    options.cache = cache;
    if (cache != nullptr && reweighs) options.bake.reweighs = &cache->paths;
    if (cache != nullptr && !is_quick) options.bake.keeps_paths = &cache->paths;
    BakeObserver observer;
    const double start_s = process_time_s();
    LevelBake bake(wanted, options, observer);
    auto done = bake.read();
    if (done.ok()) done = bake.prepare();
    if (done.ok()) done = bake.write();
    cpu_s = process_time_s() - start_s;
    std::error_code none;
    std::filesystem::remove(options.output, none);
    if (!done.ok()) {
      error = done.error().message;
      return false;
    }
    if (reweighs && !bake.report().is_reweighed) error = bake.report().why_traced;
    error_db = static_cast<double>(bake.contents().statistics.decay.error_db);
    photons = static_cast<double>(bake.contents().settings.photons);
    return error.empty();
  }

  bool traces_more = false;
  std::string error;
  double cpu_s = 0, error_db = 0, photons = 0;

 private:
  BakeRequest request_;
  Material material_;
  std::string sidecar_;
};

enum class Way { kAlone, kCached, kReweighed, kAsMany };

void first_bake_after_edit(benchmark::State& state, Way way) {
  EditedRoom room;
  BakeCache cache;
  BakeCache* const used = way == Way::kAlone ? nullptr : &cache;
  if (!room.error.empty() || (used != nullptr && !room.bake(false, false, used, false)))
    return state.SkipWithError(room.error.c_str());
  double cpu_s = 0, error_db = 0;
  bool is_more = false;
  for (auto _ : state) {
    is_more = !is_more;
    room.traces_more = way == Way::kAsMany;
    if (!room.bake(true, is_more, used, way == Way::kReweighed))
      return state.SkipWithError(room.error.c_str());
    cpu_s += room.cpu_s;
    error_db += room.error_db;
  }
  const auto count = static_cast<double>(state.iterations());
  state.counters["cpu_ms"] = 1e3 * cpu_s / count;
  state.counters["error_db"] = error_db / count;
  state.counters["photons"] = room.photons;
  state.counters["paths_kB"] = static_cast<double>(cache.paths.bytes()) / 1e3;
}
BENCHMARK_CAPTURE(first_bake_after_edit, alone, Way::kAlone)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(first_bake_after_edit, cached, Way::kCached)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(first_bake_after_edit, reweighed, Way::kReweighed)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(first_bake_after_edit, as_many, Way::kAsMany)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
