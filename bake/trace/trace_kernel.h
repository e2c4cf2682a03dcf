// trace_kernel.h: shades the surface hits of many photons at once.
//
// The inner loop of the photon tracer, without rays: air attenuation, absorption, deposits,
// roulette and the next direction. Photons advance in lockstep, bounce by bounce. Random numbers,
// logarithms and directions are computed with one photon per lane, band values with one band per
// lane, eight bands of one photon in a register. The code consists of plain loops that compilers
// vectorise, compiled once per instruction set through Highway. None of its operations rounds
// differently between instruction sets or compilers.
//
// Threads: shade() may be called concurrently, with one ShadeScratch per call.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bake/trace/deposit.h"
#include "bake/trace/deposit_weight.h"
#include "bake/trace/image_index.h"
#include "bake/trace/kernel_material.h"
#include "bake/trace/path_record.h"
#include "bake/trace/scene.h"
#include "common/bands.h"
#include "common/vec.h"

namespace clamor {

// Photons per step: enough to fill the lanes, few enough for the L2 cache.
inline constexpr std::size_t kStepPhotons = 1024;

struct alignas(64) KernelPhoton {
  Bands power{};   // power of each band's own paths; multiply by weight for this path
  Bands weight{};  // weights of the balance heuristic; their sum is 8
  double travelled_m = 0;
  std::uint64_t number = 0, key = 0;     // photon index and key of its random numbers
  std::array<float, 2> first_bounce{};   // third and fourth coordinate of the Sobol point
  std::uint16_t run = 0, index = 0;      // run within the call; index within the run
  bool is_copy = false;                  // of another photon of the run (weight_window.h)
  bool is_specular = true;               // only mirrors have reflected it
  float deposit_times = 1;               // factor of the power of its next deposit; 0: it has none
  PortalSet portals{};                   // that the path has passed
  std::uint32_t node = PathNode::kNone;  // the last hit, if paths are recorded
};

struct KernelSettings {
  float roulette_exponent = 0;
  double max_path_m = 0;
  double fade_m = 0;  // see TraceSettings::fade_s
  std::uint32_t max_bounces = 0xffffffff;
  double seconds_per_m = 1 / 343.2;
  Bands air_log2_loss_per_m{};  // attenuation of energy: 2^(-loss r)
  float offset_m = 0;           // offset of the next ray from the surface
  DepositWeight deposit_weight{};
  // Paths that are left out, because image sources stand for them; null: none.
  const ImageIndex* images = nullptr;
};

// Statistics of a run. Powers are per photon, in the units of Deposit::power.
struct TraceTally {
  std::uint64_t photons = 0, bounces = 0, escaped = 0;  // copies of photons do not escape
  double legs_m = 0;                                    // total distance between surfaces
  std::uint64_t legs = 0;
  std::array<double, kBandCount> power_escaped{}, power_unfinished{};
  // Power that mirrors reflected on paths that image sources stand for, and that no deposit has.
  std::array<double, kBandCount> power_of_images{};

  void add(const TraceTally& other, double power_share = 1);
};

// Power of a run that has arrived at the surfaces of a material, before these absorb.
struct ArrivedPower {
  std::uint32_t material = 0;
  Bands power{};  // per photon, in the units of Deposit::power
};

// Output of deposits, with space for two per photon of the step.
struct DepositSink {
  Deposit* deposits = nullptr;
  std::uint16_t* runs = nullptr;  // run of each deposit
  std::size_t count = 0;
  // If paths are recorded: the node of each deposit, and powers without a deposit.
  std::uint32_t* nodes = nullptr;
  std::vector<PathTally>* tallies = nullptr;
};

// Per run of the call.
struct KernelRun {
  float deposit_threshold = 0;  // of the weight, for deposits from `early_until_m` on
  double early_until_m = 0;
  bool deposits_early = true;  // whether there are deposits before it
  std::uint32_t emitter = 0;
  TraceTally tally;
  std::array<double, kBandCount>* arrived = nullptr;  // by material; null: not counted
};

struct ShadeScratch;
struct DeleteScratch {
  void operator()(ShadeScratch* scratch) const;
};
std::unique_ptr<ShadeScratch, DeleteScratch> make_shade_scratch();

// Shades one bounce of the photons listed in `alive` (slots, at most kStepPhotons), given their
// rays and hits. Writes deposits to the sink and statistics to the runs. Returns the number of
// surviving photons; their slots and next rays are then at the front of `alive` and `rays`.
std::size_t shade(const KernelSettings& settings, std::span<const KernelMaterial> materials,
                  std::uint32_t bounce, std::span<KernelPhoton> photons,
                  std::span<std::uint16_t> alive, std::span<Ray> rays,
                  std::span<const SurfaceHit> hits, std::span<KernelRun> runs,
                  ShadeScratch& scratch, DepositSink& sink);

// For tests: the instruction sets of this CPU, best first, and a way to force one ("" for the
// best). Must not be called while tracing.
std::vector<std::string> trace_kernel_targets();
void force_trace_kernel_target(const std::string& name);

}  // namespace clamor
