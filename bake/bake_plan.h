// bake_plan.h: how many photons each emitter gets, and how many sources are kept.
//
// Photons traced and sources stored are separate: photons decide how good the sources are, sources
// how large the file is. The plan is a function of the scene, of how much power each emitter has
// and of the settings. It does not depend on where emitters stand, but for how many rooms they are
// in, so that moving one leaves the photons of all others as they were.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/level.h"

namespace clamor {

struct BakePlan {
  std::uint32_t rooms = 1;             // that emitters are in, as far as they see each other
  std::uint64_t sources = 0;           // most secondary sources to keep
  std::uint64_t wanted_photons = 0;    // which are shared out
  std::vector<std::uint64_t> photons;  // per emitter
  double deposit_threshold = 0;        // of a deposit, see TraceSettings
  double deposits = 0;                 // that will be left, about

  std::uint64_t all_photons() const;

  // The photons of every emitter as runs, and these as batches of at most kRunPhotons, one to a
  // task.
  std::vector<std::vector<PhotonRun>> batches() const;
};

// Where the settings leave photons or sources at 0:
//
//   sources   200 000 for each room with emitters in it
//   photons   as many as leave about four times as many deposits as there are sources to keep
//
// How many deposits a photon leaves is judged by a pilot of 1024. If more than 1.25 deposits would
// come to a source, weak ones are thinned while tracing. Photons are shared out by power; an
// emitter with any power gets at least kMinPhotons. A free field gets none.
inline constexpr std::uint64_t kMinPhotons = 4, kMaxSources = 10'000'000;
BakePlan make_bake_plan(const Scene& scene, const Level& level, const BakeSettings& settings,
                        const TraceSettings& trace);

// Memory that a bake by this plan takes at its peak, somewhat above what it is found to take: 65 MB
// for the program and the thinning's room to work, 300 bytes a triangle, 215 a source (sorting
// takes two and a half times the 88 of a source), and what threads have under way. Measured: the
// violin room 123 to 159 MB for 300 000 sources, depending on who lags, 251 for a million, 646 for
// three.
// Where the octree is sorted on disk, a source takes 130.
enum class SortStorage : std::uint8_t { kMemory, kFiles };
std::uint64_t bake_memory_bytes(const Level& level, const BakePlan& plan, int threads,
                                SortStorage sorted = SortStorage::kMemory);

// How many rooms the emitters are in: those that see each other, directly or through others, share
// one. Emitters beyond the first 64 rooms' worth are counted to the first.
std::uint32_t emitter_rooms(const Scene& scene, const Level& level);

}  // namespace clamor
