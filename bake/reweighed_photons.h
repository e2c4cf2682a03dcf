// reweighed_photons.h: the photons of an earlier bake with the powers of other absorption.
//
// Re-weighing (kept_run.h) increases the variance: paths were ended where the old level was quiet,
// and a less absorbing one may be loud there. Re-weighed photons are therefore used only if, in
// each band, enough deposits carry the power of each stretch of the decay down to -30 dB
// (enough_deposits()). That choice looks at the same deposits, so that it is only without it that
// the mean is exact.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "bake/bake_plan.h"
#include "bake/trace/image_index.h"
#include "bake/trace/run_source.h"
#include "common/bands.h"
#include "common/material.h"
#include "common/result.h"

namespace clamor {

// Serves one pass over the plan.
class ReweighedPhotons final : public RunSource {
 public:
  // `plan` and `images` are those by which the photons were traced; `runs` has one run each, in the
  // order of the plan.
  ReweighedPhotons(BakePlan plan, std::shared_ptr<const ImageIndex> images,
                   std::vector<TracedRuns> runs)
      : plan_(std::move(plan)), images_(std::move(images)), runs_(std::move(runs)) {}

  Result<bool> find(const PhotonRun& run, TracedRuns& found) override;
  Result<void> record(const TracedRuns& /*traced*/) override { return {}; }
  bool is_instant() const override { return true; }

  const BakePlan& plan() const { return plan_; }
  const std::shared_ptr<const ImageIndex>& images() const { return images_; }
  std::span<const TracedRuns> runs() const { return runs_; }

 private:
  BakePlan plan_;
  std::shared_ptr<const ImageIndex> images_;
  std::vector<TracedRuns> runs_;
  std::size_t next_ = 0;
};

// By material, the factor of the power of a path that meets it once. Fails if a path of the new
// materials cannot be made of one of the old. Paths through massive walls, below -20 dB, are
// re-weighed as if they had been reflected.
Result<std::vector<Bands>> reweighing_ratios(std::span<const Material> old_materials,
                                             std::span<const Material> new_materials);

// Whether, in each band, the power of the deposits decays by 30 dB before fewer than `least` of
// them carry it, or by 20 dB before there are none. The deposits are divided by their delay into
// stretches of half their mean delay, in which the power of a room falls by 2.2 dB. n deposits of
// powers p count as (sum p)^2 / sum p^2, the effective sample size, which is n if the powers are
// equal.
bool enough_deposits(std::span<const TracedRuns> runs, std::span<const double> photon_shares,
                     double least);

}  // namespace clamor
