// photon_tracer.h: traces sound photons through a scene and records a deposit at every reflection.
//
// A photon leaves an emitter by importance sampling of its directivity and carries eight bands of
// power. At every surface it leaves a deposit (power after absorption, delay, normal, mirror
// direction) and is reflected by importance sampling of the BRDF, until Russian roulette ends it
// (the paper, section 4).
//
// One path serves eight bands. Its direction is drawn from the mixture of the bands' BRDFs,
// weighted by the path's band weights w, and then w <- 8 w q / sum(w q), with q the bands'
// densities. This is the balance heuristic over whole paths (E. Veach, L. Guibas, SIGGRAPH 1995).
// No band is worse than if traced alone with an eighth of the photons; with equal exponents nothing
// is lost.
//
// The photons of a run advance in lockstep, so that shading is vector code (trace_kernel.h) and
// rays are traced in batches.
//
// Photon i of an emitter depends on the seed, the emitter (its name selects the random numbers),
// the scene and the settings: philox(seed, name; i, bounce, use) and Sobol point i. Photons may
// therefore be traced in any order on any thread, tracing more photons only adds deposits, and
// moving one emitter does not change the photons of the others.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bake/trace/deposit.h"
#include "bake/trace/path_record.h"
#include "bake/trace/portal_crossings.h"
#include "bake/trace/scene.h"
#include "bake/trace/trace_kernel.h"
#include "bake/trace/weight_window.h"
#include "formats/bake_file/bake_metadata.h"

namespace clamor {

struct Emitter;
struct Level;
struct TraceWorkspace;
template <class T>
class ObjectPool;  // common/object_pool.h

struct TraceSettings {
  std::uint64_t seed = 1;
  // Survival probability = (power after / before)^exponent, in the loudest band.
  double roulette_exponent = kRouletteExponent;
  double longest_path_s = 10;  // longer paths end and are counted as unfinished
  double fade_s = 0;           // before that, over which the power of paths falls to 0 linearly
  double speed_mps = 343.2;
  Bands air_loss_per_m{};
  std::uint32_t max_bounces = 0xffffffff;

  // Thins weak deposits without bias: if the weight w of a deposit (deposit_weight.h) is below this
  // share T of its photon's initial power, it is kept with probability (w / T)^(3/4) and its power
  // is divided by that probability. 0 keeps all.
  double deposit_threshold = 0;
  // Before this path length, only the first `early_photons` of an emitter leave deposits, and those
  // leave all.
  double early_until_m = 0;
  std::uint64_t early_photons = 0;

  // Estimated decay, for the weights of deposits and for weight windows (weight_window.h); unknown:
  // none.
  DecayModel decay{};

  // Paths that leave no deposits, because image sources stand for them (bake/early); null: none.
  std::shared_ptr<const ImageIndex> images{};

  // The set of portals that every photon starts with: the state of the level's portals.
  PortalSet first_portals{};
};

inline constexpr std::uint32_t kRunPhotons = kStepPhotons;

// Photons first .. first + count - 1 of one emitter; count is at most kRunPhotons.
struct PhotonRun {
  std::uint32_t emitter = 0;
  std::uint64_t first = 0;
  std::uint32_t count = 0;
};

struct TracedRun {
  PhotonRun run;
  std::size_t first_deposit = 0, deposits = 0;  // range of TracedRuns::deposits()
  TraceTally tally;
  std::vector<ArrivedPower> arrived = {};  // at the materials that it has met, ascending
};

// The deposits of several runs, grouped by run, then ordered by bounce and photon. Reuse objects
// with clear(), which keeps the capacity: touching new memory costs as much as shading.
class TracedRuns {
 public:
  std::span<const TracedRun> runs() const { return runs_; }
  std::span<const Deposit> deposits() const { return {deposits_.data(), count_}; }

  std::span<const Deposit> deposits_of(const TracedRun& run) const {
    return deposits().subspan(run.first_deposit, run.deposits);
  }

  void clear();

  // Records the paths of what is traced from now on.
  void record_paths() { records_paths_ = true; }
  // The paths of all runs; empty unless they are recorded.
  const PathRecord& paths() const { return paths_; }

  // Appends a run traced earlier, whose paths are not recorded.
  void append(const PhotonRun& run, const TraceTally& tally, std::span<const Deposit> deposits,
              std::vector<ArrivedPower> arrived = {});

 private:
  friend class PhotonTracer;
  void make_room(std::size_t deposits);
  void sort_by_run(std::size_t first_deposit, std::size_t first_run);

  std::vector<TracedRun> runs_;
  std::vector<Deposit> deposits_;  // both have at least count_ elements
  std::vector<std::uint16_t> run_of_;
  bool records_paths_ = false;
  PathRecord paths_;
  std::size_t count_ = 0;
};

class PhotonTracer {
 public:
  // Scene and level must outlive the tracer.
  PhotonTracer(const Scene& scene, const Level& level, const TraceSettings& settings);

  // Traces the runs and appends their deposits. Every photon carries the full power of its emitter,
  // so the caller divides by the emitter's number of photons. The deposits of a run do not depend
  // on the other runs of the call. Threads: may be called concurrently.
  void trace(std::span<const PhotonRun> runs, TracedRuns& result) const;

  // The rays that the photons of a run leave their emitter on, by photon.
  void first_rays(const PhotonRun& run, std::vector<Ray>& rays) const;

  const TraceSettings& settings() const { return settings_; }
  double speed_mps() const { return settings_.speed_mps; }

  // The weight below which deposits of an emitter have been thinned.
  double deposit_threshold(std::uint32_t emitter) const;

  // Key of an emitter's random numbers: a hash of the seed and its name.
  std::uint64_t emitter_key(std::uint32_t emitter) const { return emitter_keys_[emitter]; }

  // Total emitted power per band.
  const std::array<double, kBandCount>& power_emitted() const { return power_emitted_; }

 private:
  KernelPhoton emit(std::uint32_t emitter, std::uint64_t number, Ray& ray) const;
  void trace_batch(std::span<const PhotonRun> runs, TracedRuns& result) const;

  const Scene& scene_;
  const Level& level_;
  TraceSettings settings_;
  KernelSettings kernel_settings_;
  PortalCrossings portals_;
  ReflectionLaws laws_;
  std::vector<KernelMaterial> materials_;
  std::vector<std::uint64_t> emitter_keys_;  // keys of the random numbers
  std::array<double, kBandCount> power_emitted_{};
  std::shared_ptr<ObjectPool<TraceWorkspace>> workspaces_;
};

// Power that an emitter radiates in all directions, in the units of Source::power.
double emitted_power(const Emitter& emitter, std::size_t band);
double emitted_power(const Emitter& emitter);  // over all bands

}  // namespace clamor
