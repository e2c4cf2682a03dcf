// decay_estimate.h: estimates the energy decay of a level and its statistical error.
//
// During tracing, deposits are received at up to four receivers: those in line of sight, weighted
// by the BRDF towards the receiver, 1 / r^2 and air attenuation. Direct sound is exact and left
// out. The results are T30 per band with its error, for the summary, and the error of the decay
// curves, for progress reports and for ending a bake at a given error.
//
// Receivers are placed half way from an emitter to the first surface in one of four fixed
// directions, spread evenly over several emitters. They therefore lie inside the level, away from
// walls and in line of sight of their emitter, and never change. A receiver registers its own
// emitter only. If emitters are many and have few photons each (a crowd), every receiver registers
// all.
//
// Errors are delete-a-group jackknife estimates (B. Efron, C. Stein, The jackknife estimate of
// variance, Annals of Statistics 9(3), 1981): with G groups of photons and x_(j) the result without
// group j, var x = (G - 1) / G sum_j (x_(j) - mean x)^2. Groups are consecutive photons, which the
// Sobol sequence distributes evenly, so a group is a small bake of its own. Photons are counted in
// units of 64. When 32 groups are full they are merged in pairs, so there are always 16 to 32. In a
// crowd, runs are assigned to groups round-robin.
//
// Threads: receive() may be called concurrently; all else one at a time, in the order of the
// photons. Memory: 26 kB per receiver, group and second.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/reflection.h"
#include "formats/bake_file/bake_metadata.h"

namespace clamor {

struct Emitter;
struct Level;

struct DecayReceiver {
  Vec3 position_m;
  std::uint32_t emitter = 0;
};

// Receivers of a level; none if no surface is near the emitters.
std::vector<DecayReceiver> decay_receivers(const Scene& scene,
                                           const std::vector<Emitter>& emitters);

// Energy of one deposit at one receiver.
struct ReceivedEnergy {
  std::uint32_t receiver = 0;
  std::uint32_t photon = 0;  // index within the run
  std::uint32_t step = 0;    // time step
  Bands energy{};
};

class DecayEstimate {
 public:
  static constexpr double kStep_s = 0.0025;

  // Scene and level must outlive the estimate. One in `stride` runs of every emitter is used.
  DecayEstimate(const Scene& scene, const Level& level, const TraceSettings& settings,
                std::span<const std::uint64_t> photons, std::uint64_t stride);

  // Upper bound of the memory that an estimate uses.
  static std::uint64_t max_bytes(double longest_path_s);

  bool wants(const PhotonRun& run) const;

  // Appends the energies of a run's deposits at all receivers.
  void receive(std::span<const Deposit> deposits, std::vector<ReceivedEnergy>& received) const;

  // Accumulates the energies of a run for which wants() holds.
  void add(const PhotonRun& run, std::span<const ReceivedEnergy> received);

  // Standard error of the decay curves in dB, extrapolated to all runs instead of one in `stride`:
  // the root mean square over receivers, bands and levels of 0, -5 ... -30 dB. Nothing without
  // receivers or with too few photons.
  std::optional<double> error_db() const;

  // Backward-integrated energy at a receiver from `time_s` on, in dB relative to intensity 1 for 1
  // s. Nothing if it is zero.
  std::optional<double> level_db(std::size_t index, std::size_t band, double time_s) const;

  // T30 per band as the mean over receivers, where most have one. Values are rounded to
  // milliseconds and thousandths of a decibel, so that they do not depend on the last bit of a
  // CPU's pow().
  DecaySummary summary() const;

 private:
  static constexpr std::uint64_t kUnitPhotons = 64;
  static constexpr std::size_t kMaxGroups = 32, kMinGroups = 8;

  using Energy = std::array<double, kBandCount>;
  using Histogram = std::vector<Energy>;  // indexed by time step
  struct Receiver {
    DecayReceiver at;
    std::vector<Histogram> groups;
  };
  // Photons received per emitter. All receivers of an emitter have the same groups.
  struct Progress {
    std::uint64_t units = 0, units_per_group = 1;
  };

  void merge_groups(std::uint32_t emitter);
  std::size_t whole_groups(const Receiver& receiver) const;
  static std::vector<Energy> backward_integrals(std::span<const Histogram> groups);
  // T30 in a band with all groups, then without each of them.
  std::vector<std::optional<double>> t30s_s(const Receiver& receiver, std::size_t band) const;

  const Scene& scene_;
  ReflectionLaws laws_;
  Bands air_loss_per_m_;
  double speed_mps_, longest_path_s_;
  std::vector<std::uint64_t> photons_;  // per emitter
  std::uint64_t stride_;
  bool crowd_ = false;
  std::vector<Receiver> receivers_;  // sorted by emitter
  std::vector<Progress> progress_;   // per emitter; a crowd uses the first only
};

}  // namespace clamor
