// trace_kernel.h: what happens to photons at a surface, for many of them at once.
//
// The inner part of the photon tracer, without rays: air, absorption, deposits, roulette and the
// draw of the next direction. Photons advance in step, bounce by bounce. What is alike for all
// (random numbers, logarithms, directions) is computed one photon per lane; what is per band one
// band per lane, eight bands of one photon in one register. These are plain loops that compilers
// turn into vector code, compiled once per instruction set through Highway; since no operation used
// rounds differently on any of them, neither instruction set nor compiler changes a bit.
//
// Threads: shade() from any number at once, each with its own ShadeScratch.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bake/trace/kernel_material.h"
#include "bake/trace/scene.h"
#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"

namespace clamor {

// Photons that advance in step: enough to fill the lanes, few enough to stay in the L2 cache.
inline constexpr std::size_t kStepPhotons = 1024;

struct alignas(64) KernelPhoton {
  Bands power{};   // of each band's own paths; times weight for this path
  Bands weight{};  // the balance heuristic's, sums to 8
  double travelled_m = 0;
  std::uint64_t number = 0, key = 0;    // of the random numbers
  std::array<float, 2> first_bounce{};  // the Sobol point's other half
  std::uint16_t run = 0, index = 0;     // within the call; within the run
};

struct KernelSettings {
  float kappa = 0.5f;
  double longest_m = 0;
  std::uint32_t max_bounces = 0xffffffff;
  double seconds_per_m = 1 / 343.2;
  Bands air_log2_loss_per_m{};  // energy falls as 2^(-loss r)
  float offset_m = 0;           // off the surface, for the next ray
};

// What became of the photons of one run. Powers in the units of Source::power.
struct TraceTally {
  std::uint64_t photons = 0, bounces = 0, escaped = 0;
  double legs_m = 0;  // total length between surfaces
  std::uint64_t legs = 0;
  std::array<double, kBandCount> power_escaped{}, power_unfinished{};

  void add(const TraceTally& other, double power_share = 1);
};

// Where deposits go: room for two per photon of the step.
struct DepositSink {
  Source* deposits = nullptr;
  std::uint16_t* runs = nullptr;     // of each deposit
  std::uint16_t* photons = nullptr;  // index within the run
  std::size_t count = 0;
};

// Per run of the call: what a deposit must have to be kept for certain, and the emitter.
struct KernelRun {
  float deposit_threshold = 0;
  std::uint32_t emitter = 0;
  TraceTally tally;
};

struct ShadeScratch;
struct DeleteScratch {
  void operator()(ShadeScratch* scratch) const;
};
std::unique_ptr<ShadeScratch, DeleteScratch> make_shade_scratch();

// One bounce of the photons whose slots are listed in `alive`, at most kStepPhotons, given their
// rays and where these end. Leaves deposits in the sink and counts in the runs; returns how many
// photons are still alive: their slots and their next rays are then the first of `alive` and
// `rays`.
std::size_t shade(const KernelSettings& settings, std::span<const KernelMaterial> materials,
                  std::uint32_t bounce, std::span<KernelPhoton> photons,
                  std::span<std::uint16_t> alive, std::span<Ray> rays,
                  std::span<const SurfaceHit> hits, std::span<KernelRun> runs,
                  ShadeScratch& scratch, DepositSink& sink);

// For tests: the instruction sets this CPU has, best first, and a way to be limited to one of them
// ("" for the best). Not while anything is traced.
std::vector<std::string> trace_kernel_targets();
void force_trace_kernel_target(const std::string& name);

}  // namespace clamor
