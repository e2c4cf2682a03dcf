// photon_tracer.h: sends sound photons through a scene and notes where they are reflected.
//
// A photon leaves an emitter by importance sampling of its directivity, carries eight bands' power
// from surface to surface, leaves a secondary source at each (power after absorption, delay,
// normal, mirror direction), is reflected by importance sampling of the surface's law, and dies by
// Russian roulette (the paper, section 4).
//
// One path serves eight bands: its direction is drawn from the mixture of the bands' laws weighted
// by the path's own band weights w, and w <- 8 w q / sum(w q), q the bands' densities: the balance
// heuristic over whole paths (E. Veach, L. Guibas, SIGGRAPH 1995). No band does worse than traced
// alone with an eighth of the photons; with like exponents nothing is lost.
//
// The photons of a run advance in step, so that the shading of one bounce is vector code
// (trace_kernel.h) and rays are asked for many at a time.
//
// Photon i of an emitter is a function of the seed, the emitter's own content (its name picks the
// random numbers), the scene and the settings: philox(seed, name; i, bounce, use) and Sobol point
// i. So photons may be traced in any order on any thread, tracing more only adds to those before,
// and moving one emitter changes nothing for the others.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bake/trace/scene.h"
#include "bake/trace/trace_kernel.h"
#include "formats/bake_file/source.h"
#include "formats/level/level.h"

namespace clamor {

struct TraceSettings {
  std::uint64_t seed = 1;
  double roulette_exponent =
      0.5;                     // a photon survives with (power after / before)^kappa, loudest band
  double longest_path_s = 10;  // photons older than this are given up, and counted
  double speed_mps = 343.2;
  Bands air_loss_per_m{};
  std::uint32_t max_bounces = 0xffffffff;

  // A deposit whose power P, summed over bands, is below this share T of the power that its photon
  // left the emitter with is kept with probability (P / T)^(1/4), and then carries the inverse
  // times as much: fewer deposits, without bias. 0 keeps all. source_thinning.h says why the fourth
  // root.
  double deposit_threshold = 0;
};

inline constexpr std::uint32_t kRunPhotons = kStepPhotons;

// Photons first .. first + count - 1 of one emitter, at most kRunPhotons of them.
struct PhotonRun {
  std::uint32_t emitter = 0;
  std::uint64_t first = 0;
  std::uint32_t count = 0;
};

struct TracedRun {
  PhotonRun run;
  std::size_t first_deposit = 0, deposits = 0;  // into TracedRuns
  TraceTally tally;
};

// What some runs left behind, run after run; within one by bounce, then by photon. Meant to be
// cleared and used again: memory once had is kept, since fresh pages cost as much as the shading.
class TracedRuns {
 public:
  std::span<const TracedRun> runs() const { return runs_; }
  std::span<Source> deposits() { return {deposits_.data(), count_}; }
  std::span<const Source> deposits() const { return {deposits_.data(), count_}; }

  // Per deposit: which photon of its run.
  std::span<const std::uint16_t> photons() const { return {photons_.data(), count_}; }

  void clear();

  // Adds a run that was traced before.
  void append(const PhotonRun& run, const TraceTally& tally, std::span<const Source> deposits,
              std::span<const std::uint16_t> photons);

 private:
  friend class PhotonTracer;
  void make_room(std::size_t deposits);
  void sort_by_run(std::size_t first_deposit, std::size_t first_run);

  std::vector<TracedRun> runs_;
  std::vector<Source> deposits_;  // these three are longer than count_
  std::vector<std::uint16_t> photons_, run_of_;
  std::size_t count_ = 0;
};

class PhotonTracer {
 public:
  // Scene and level must outlive the tracer.
  PhotonTracer(const Scene& scene, const Level& level, const TraceSettings& settings);

  // Traces the runs and appends what they leave behind. Every photon carries the whole power of its
  // emitter, so the caller divides by how many it traces of that emitter. What a run leaves does
  // not depend on which others are traced with it.
  void trace(std::span<const PhotonRun> runs, TracedRuns& result) const;

  // What the random numbers of an emitter are keyed by: the seed and its name.
  std::uint64_t emitter_key(std::uint32_t emitter) const { return emitter_keys_[emitter]; }

  // Power that all emitters radiate, per band.
  const std::array<double, kBandCount>& power_emitted() const { return power_emitted_; }

 private:
  KernelPhoton emit(std::uint32_t emitter, std::uint64_t number, Ray& ray) const;
  void trace_batch(std::span<const PhotonRun> runs, TracedRuns& result) const;

  const Scene& scene_;
  const Level& level_;
  TraceSettings settings_;
  KernelSettings kernel_settings_;
  PhongLobes lobes_;
  std::vector<KernelMaterial> materials_;
  std::vector<std::uint64_t> emitter_keys_;  // of their random numbers
  std::array<double, kBandCount> power_emitted_{};
};

// What an emitter radiates into all directions, in the units of Source::power.
double emitted_power(const Emitter& emitter, std::size_t band);

}  // namespace clamor
