// bake_plan.h: decides how many photons each emitter gets and how many sources are kept.
//
// Photons and sources are separate: photons determine the quality of the sources, sources the size
// of the file. The plan depends on the scene, the emitters' powers and the settings. Emitter
// positions matter only for the number of rooms they are in, so moving one emitter leaves the
// photons of all others unchanged. What a plan needs of memory is here, too.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/result.h"
#include "formats/bake_file/bake_metadata.h"

namespace clamor {

struct BakeOptions;
struct Level;

// How photons are traced with the settings of a bake, without what the plan and the images add.
TraceSettings trace_settings(const BakeSettings& settings);

struct BakePlan {
  std::uint32_t rooms = 1;             // rooms with emitters, see emitter_rooms()
  std::uint64_t sources = 0;           // maximum number of secondary sources
  std::uint64_t wanted_photons = 0;    // photons of the bake, distributed over the emitters
  std::vector<std::uint64_t> photons;  // per emitter
  double deposit_threshold = 0;        // see TraceSettings
  double deposits = 0;                 // estimated number of deposits
  DecayModel decay{};                  // see TraceSettings
  double longest_path_s = 0;           // see TraceSettings
  double fade_s = 0;                   // see TraceSettings: for a decay that is longer

  std::uint64_t all_photons() const;

  // Divides the photons of every emitter into runs, and the runs into batches of at most
  // kRunPhotons, one per task.
  std::vector<std::vector<PhotonRun>> batches() const;
};

// Defaults for photons, sources or the longest path of 0 in the settings:
//
//   sources        200 000 for each room with emitters in it, of at most 32 rooms
//   photons        enough for about four deposits per source
//   longest path   what the slowest band takes to decay by 60 dB, at least kUsualPath_s and at most
//                  kLongestPath_s
//
// The deposits per photon are estimated by a pilot of 1024 photons. Above 1.25 deposits per source,
// weak deposits are thinned while tracing. Photons are distributed by power; an emitter with any
// power gets at least kMinPhotons. A free field gets none.
inline constexpr std::uint64_t kMinPhotons = 4, kMaxSources = 200'000'000;
inline constexpr double kUsualPath_s = 10, kLongestPath_s = 60;
BakePlan make_bake_plan(const Scene& scene, const Level& level, const BakeSettings& settings,
                        const TraceSettings& trace);

// Takes what the pilot of an earlier plan has estimated, if that differs by no more than a step of
// its rounding. The pilot's noise takes such a step whenever an emitter moves, and all photons of a
// plan depend on the estimates.
void keep_estimates(BakePlan& plan, const BakePlan& earlier);

// Upper estimate of the peak memory of a bake: 65 MB for the program and the thinning's buffers,
// 300 bytes per triangle, 190 per source (joining those of two states of the level takes 2.1 times
// the 88 bytes of a source, sorting 1.6 times), 150 per 1024 photons, and the batches in flight.
// Measured in the violin room: 134 to 146 MB for 300 000 sources, depending on thread timing,
// 226 MB for one million, 498 MB for three million. What DecayEstimate takes is added. With
// kFiles, thinning, patch radii and sorting work on disk, with 40 MB or more for any number of
// sources.
inline constexpr std::uint64_t kBytesPerSource = 190, kBytesPerRun = 150;
enum class SortStorage : std::uint8_t { kMemory, kFiles };
std::uint64_t bake_memory_bytes(const Level& level, const BakePlan& plan, int threads,
                                SortStorage sorted = SortStorage::kMemory);

// A shard keeps no sources, so it needs far less memory than a bake.
std::uint64_t shard_memory_bytes(const Level& level, BakePlan plan, int threads);

// Where the sources are thinned and sorted.
struct SortPlace {
  SortStorage storage = SortStorage::kMemory;
  std::uint64_t step_bytes = 0;  // of memory for each step on disk
};

// Fail if the plan, for each state of the level, exceeds the memory limit. For the threads of the
// caller's team.
Result<SortPlace> check_memory(const Level& level, BakePlan plan, const BakeOptions& options);
Result<void> check_shard_memory(const Level& level, const BakePlan& plan,
                                const BakeOptions& options);

// Number of rooms with emitters. Emitters that see each other, directly or through others, share a
// room. Emitters beyond the first 64 rooms count towards the first.
std::uint32_t emitter_rooms(const Scene& scene, const Level& level);

}  // namespace clamor
