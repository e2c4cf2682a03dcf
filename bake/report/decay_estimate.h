// decay_estimate.h: how the sound of a level dies away at a few places, and how sure that is.
//
// While photons are traced, their deposits are also heard at up to four places: in sight, with the
// reflection law towards the listener, 1 / r^2 and air; without the direct sound, which is exact.
// From that come T30 per band and its error for the summary, and the error of the decay curves, for
// progress and for ending a bake at a wanted error.
//
// Places: each half way from an emitter to the first surface in one of four fixed directions; with
// several emitters, spread over them evenly. So they lie inside the level, off its walls, within a
// straight line of sound, and are the same every time. A place hears its own emitter. Where
// emitters are many and have few photons each (a crowd), every place hears all.
//
// Errors are delete-a-group jackknife estimates (B. Efron, C. Stein, The jackknife estimate of
// variance, Annals of Statistics 9(3), 1981): with G groups of photons and x_(j) what comes out
// without group j, var x = (G - 1) / G sum_j (x_(j) - mean x)^2. Groups are consecutive photons, as
// these are spread evenly by the Sobol sequence: a group is a small bake of its own. Photons come
// in units of 64; when 32 groups are full they are joined in pairs, so that there are 16 to 32 of
// them at any time. In a crowd runs are dealt out in turn.
//
// Threads: hear() on any number at once; the rest one at a time, in the order of the photons.
// Memory: 26 kB per place, group and second.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/reflection.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/level.h"

namespace clamor {

struct DecayReceiver {
  Vec3 listener_m;
  std::uint32_t emitter = 0;
};

// The places of a level; none where emitters have no surface near them.
std::vector<DecayReceiver> decay_receivers(const Scene& scene,
                                           const std::vector<Emitter>& emitters);

// Energy of one deposit at one place.
struct ReceivedEnergy {
  std::uint32_t place = 0;
  std::uint32_t photon = 0;  // within its run
  std::uint32_t step = 0;    // of time
  Bands energy{};
};

class DecayEstimate {
 public:
  static constexpr double kStep_s = 0.0025;

  // Scene and level must outlive the estimate. `stride`: of every emitter's runs, one in so many is
  // heard.
  DecayEstimate(const Scene& scene, const Level& level, const TraceSettings& settings,
                std::span<const std::uint64_t> photons, std::uint64_t stride);

  // Most memory that an estimate takes.
  static std::uint64_t max_bytes(double longest_path_s);

  bool wants(const PhotonRun& run) const;

  // Adds what the places hear of a run's deposits.
  void hear(std::span<const Source> deposits, std::span<const std::uint16_t> photons,
            std::vector<ReceivedEnergy>& heard) const;

  // Takes in a run that was wanted. Deposits carry the whole power of their emitter.
  void add(const PhotonRun& run, std::span<const ReceivedEnergy> heard);

  // Standard error of the decay curves in dB, had all runs so far been heard: root mean square over
  // places, bands and the times when the curve has fallen by 0, 5 ... 30 dB. Nothing where there
  // are no places or too few photons to tell.
  std::optional<double> error_db() const;

  // Energy that has yet to come at a place, so long after the emitter, in dB re intensity 1 for 1
  // s; nothing if none does.
  std::optional<double> level_db(std::size_t place, std::size_t band, double time_s) const;

  // T30 as the mean over the places that can tell, where most can. In whole milliseconds and
  // thousandths of decibels, so that they do not depend on the last bit of a CPU's pow().
  DecaySummary summary() const;

 private:
  static constexpr std::uint64_t kUnitPhotons = 64;
  static constexpr std::size_t kMostGroups = 32, kLeastGroups = 8;

  using Energy = std::array<double, kBandCount>;
  using Histogram = std::vector<Energy>;  // by time step
  struct Heard {
    DecayReceiver place;
    std::vector<Histogram> groups;
  };
  // How many photons of an emitter were heard; all places that listen to it have like groups.
  struct Listening {
    std::uint64_t units = 0, units_per_group = 1;
  };

  void join_groups(std::uint32_t emitter);
  std::size_t whole_groups(const Heard& heard) const;
  std::optional<double> t30_s(const Heard& heard, std::size_t band, std::size_t left_out) const;
  std::optional<double> mean_t30_s(std::span<const Heard> group, std::size_t band,
                                   std::size_t left_out) const;

  const Scene& scene_;
  ReflectionLaws laws_;
  Bands air_loss_per_m_;
  double speed_mps_, longest_path_s_;
  std::vector<std::uint64_t> photons_;  // per emitter
  std::uint64_t stride_;
  bool crowd_ = false;
  std::vector<Heard> places_;         // by emitter
  std::vector<Listening> listening_;  // per emitter; in a crowd, the first is everybody's
};

}  // namespace clamor
