// path_cache.h: keeps traced photons in memory, to re-weigh them when absorption changes.
//
// The directions of photons do not depend on absorption. If only absorption has changed, a path
// that has met materials 1, 2, ... n_1, n_2, ... times carries, in each band, the power
//
//     new power = old power * product over materials m of ((1 - new a_m) / (1 - old a_m)) ^ n_m.
//
// Russian roulette, splitting and thinning stay as they were traced: their probabilities are part
// of the old powers and nothing has to be drawn again. The estimate is unbiased wherever the old
// reflectance is above zero. (Correlated sampling: H. Kahn. Use of Different Monte Carlo Sampling
// Techniques. Symposium on Monte Carlo Methods, 1956.)
//
// The variance grows: paths were ended where the old level was quiet, and a less absorbing one may
// be loud there. Re-weighed photons are therefore used only if, in each band,
// enough deposits carry the power of each stretch of the decay down to -30 dB (enough_deposits()).
// That choice looks at the same deposits, so that it is only without it that the mean is exact.
//
// Threads: const functions may be called concurrently. Memory: 96 bytes for each deposit, 8 for
// each reflection and 40 for each power without a deposit, with a bound; re-weighed deposits are
// copies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/bake_plan.h"
#include "bake/trace/image_index.h"
#include "bake/trace/photon_tracer.h"
#include "common/material.h"
#include "common/result.h"
#include "formats/bake_file/bake_metadata.h"

namespace clamor {

struct Level;

// The photons of a bake, with other powers than they were traced with.
struct ReweighedPhotons {
  BakePlan plan;                             // by which they were traced
  std::shared_ptr<const ImageIndex> images;  // as in TraceSettings
  std::vector<TracedRuns> batches;           // those of plan.batches()
};

class PathCache {
 public:
  static constexpr std::uint64_t kMaxBytes = 256'000'000;
  // In the violin room and Sponza, edits that left 100 deposits gave the decay times of fresh bakes
  // within the error of both, and those that left 20 gave up to a third less.
  static constexpr double kMinDeposits = 64;

  // `min_deposits`: see enough_deposits(); 0 for any number.
  explicit PathCache(std::uint64_t max_bytes = kMaxBytes, double min_deposits = kMinDeposits)
      : max_bytes_(max_bytes), min_deposits_(min_deposits) {}

  // Forgets all paths, and begins with those of a bake. `trace` are its complete settings. Keeps
  // nothing of a level with portals that are baked closed.
  void begin(const Level& level, const BakeSettings& settings, const BakePlan& plan,
             const TraceSettings& trace);
  // Takes the next of plan.batches(), with recorded paths. Forgets all paths if they are too many.
  void add(const TracedRuns& batch);

  // The photons in a level that differs from that of begin() in absorption alone. Fails, with a
  // reason for people, if it differs in more, if paths are missing, or if the variance would be too
  // high. Uses the calling TBB arena.
  Result<ReweighedPhotons> reweigh(const Level& level, const BakeSettings& settings) const;

  std::uint64_t bytes() const { return bytes_; }

 private:
  struct Batch {
    std::vector<TracedRun> runs;
    std::vector<Deposit> deposits;
    PathRecord paths;
  };

  TracedRuns reweigh(const Batch& batch, std::span<const Bands> ratios) const;

  std::uint64_t max_bytes_;
  double min_deposits_;
  std::uint64_t bytes_ = 0;
  std::uint64_t key_ = 0;  // hash of everything but the absorption
  std::vector<Material> materials_;
  BakePlan plan_;
  std::shared_ptr<const ImageIndex> images_;
  std::size_t all_batches_ = 0;
  std::vector<Batch> batches_;
};

// By material, the factor of the power of a path that meets it once. Fails if a path of the new
// materials cannot be made of one of the old.
Result<std::vector<Bands>> reweighing_ratios(std::span<const Material> old_materials,
                                             std::span<const Material> new_materials);

// Whether, in each band, the power of the deposits decays by 30 dB before fewer than `least` of
// them carry it, or by 20 dB before there are none. The deposits are divided by their delay into
// stretches of half their mean delay, in which the power of a room falls by 2.2 dB. n deposits of
// powers p count as (sum p)^2 / sum p^2, the effective sample size, which is n if the powers are
// equal.
bool enough_deposits(std::span<const TracedRuns> batches, std::span<const double> photon_shares,
                     double least);

}  // namespace clamor
