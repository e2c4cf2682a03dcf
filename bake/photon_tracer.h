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
// Every random number is philox(seed; photon, bounce, use) or Sobol point (emitter, photon), so
// photons may be traced in any order on any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/scene.h"
#include "common/reflection.h"
#include "formats/level.h"
#include "formats/source.h"

namespace clamor {

struct TraceSettings {
  std::uint64_t seed = 1;
  std::uint64_t photons = 0;    // of all emitters together
  double roulette_kappa = 0.5;  // a photon survives with (power after / before)^kappa, loudest band
  double longest_path_s = 10;   // photons older than this are given up, and counted
  double speed_mps = 343.2;
  Bands air_loss_per_m{};
  std::uint32_t most_bounces = 0xffffffff;
};

// What became of the photons. Powers in the units of Source::power.
struct TraceTally {
  std::uint64_t photons = 0, bounces = 0, escaped = 0;
  double legs_m = 0;  // total length between surfaces
  std::uint64_t legs = 0;
  std::array<double, kBandCount> power_escaped{}, power_unfinished{};

  void add(const TraceTally& other);
};

class PhotonTracer {
 public:
  // Scene and level must outlive the tracer.
  PhotonTracer(const Scene& scene, const Level& level, const TraceSettings& settings);

  // Traces photons first .. first + count - 1 of settings.photons and appends their secondary
  // sources, in order. The sum over any partition of the photons is the same.
  void trace(std::uint64_t first, std::uint64_t count, std::vector<Source>& deposits,
             TraceTally& tally) const;

  // Power that all emitters radiate, per band.
  const std::array<double, kBandCount>& power_emitted() const { return power_emitted_; }

 private:
  struct Photon;

  Photon emit(std::uint64_t number) const;
  bool reflect(Photon& photon, const Hit& hit, std::uint32_t bounce) const;

  const Scene& scene_;
  const Level& level_;
  TraceSettings settings_;
  ReflectionLaws laws_;
  std::vector<double> emitter_share_;  // cumulative share of the photons, one more than emitters
  double first_u_ = 0;                 // offset of the systematic draw of emitters
  std::array<double, kBandCount> power_emitted_{};
};

}  // namespace clamor
