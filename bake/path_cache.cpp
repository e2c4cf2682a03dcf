#include "bake/path_cache.h"

#include "bake/trace/pilot.h"
#include "bake/traced_state.h"
#include "common/thread_team.h"
#include "formats/level/level.h"

namespace clamor {

void PathCache::begin(const Level& level, const BakeSettings& settings, const BakePlan& plan,
                      const TraceSettings& trace, std::uint64_t scene) {
  // The last bake may have been stopped before it had found all of the earlier runs.
  for (auto& [place, entry] : runs_) earlier_.emplace(entry.key, std::move(entry.run));
  runs_.clear();
  if (scene != scene_) {
    forget_earlier();
    is_full_ = false;
  }
  scene_ = scene;
  paths_ = paths_hash(level, settings);
  materials_ = level.materials;
  plan_ = plan;
  images_ = trace.images;
  all_runs_ = 0;
  for (const auto& batch : plan.batches()) all_runs_ += batch.size();
}

bool PathCache::find(std::uint64_t key, const PhotonRun& run, TracedRuns& found) {
  auto earlier = earlier_.extract(key);
  if (earlier.empty()) return false;
  KeptRun& kept = earlier.mapped();
  kept.run = run;  // indices change when emitters are added or removed
  for (Deposit& deposit : kept.deposits) deposit.emitter = run.emitter;
  found.append(run, kept.tally, kept.deposits, kept.arrived);
  put(key, std::move(kept));
  return true;
}

bool PathCache::add(std::span<const std::uint64_t> keys, const TracedRuns& traced) {
  if (is_full_) return false;
  std::size_t next = 0;
  for (KeptRun& kept : kept_runs(traced)) {
    bytes_ += kept.bytes();
    put(keys[next++], std::move(kept));
  }
  if (bytes_ > max_bytes_) forget_earlier();
  if (bytes_ <= max_bytes_) return true;
  runs_.clear();
  bytes_ = 0;
  is_full_ = true;
  return false;
}

void PathCache::put(std::uint64_t key, KeptRun run) {
  const std::pair place(run.run.emitter, run.run.first);
  runs_.insert_or_assign(place, Entry{key, std::move(run)});
  if (runs_.size() == all_runs_) forget_earlier();
}

void PathCache::forget_earlier() {
  for (const auto& [key, run] : earlier_) bytes_ -= run.bytes();
  earlier_.clear();
}

Result<ReweighedPhotons> PathCache::reweigh(const Level& level,
                                            const BakeSettings& settings) const {
  if (runs_.empty() || runs_.size() != all_runs_)
    return Error("no complete bake has kept its paths");
  if (level.materials.size() != materials_.size() || has_closed_state(level) ||
      paths_hash(level, settings) != paths_)
    return Error("more than absorption has changed");
  const auto ratios = reweighing_ratios(materials_, level.materials);
  if (!ratios.ok()) return ratios.error();
  std::vector<const KeptRun*> kept;  // in the order of the plan, which is that of the map
  for (const auto& [place, entry] : runs_) kept.push_back(&entry.run);
  std::vector<TracedRuns> runs(kept.size());
  team_for(0, runs.size(), [&](std::size_t i) { runs[i] = kept[i]->reweighed(*ratios); });
  std::vector<double> photon_shares;
  for (const std::uint64_t photons : plan_.photons)
    photon_shares.push_back(photons > 0 ? 1 / static_cast<double>(photons) : 0);
  if (min_deposits_ > 0 && !enough_deposits(runs, photon_shares, min_deposits_))
    return Error("too few of the kept paths carry the new decay");
  const double speed_mps = speed_of_sound_mps(settings.air);
  if (settings.longest_path_s == 0 && plan_.longest_path_s < kLongestPath_s &&
      decay_path_m(runs, photon_shares, plan_.longest_path_s * speed_mps, speed_mps) > 0)
    return Error("the new decay needs longer paths than those that were kept");
  return ReweighedPhotons(plan_, images_, std::move(runs));
}

Result<bool> KeptPaths::find(const PhotonRun& run, TracedRuns& found) {
  return cache_.is_full() ? journals_.find(run, found) : cache_.find(keys_.of(run), run, found);
}

Result<void> KeptPaths::record(const TracedRuns& traced) {
  if (traced.runs().empty() || cache_.add(keys_.of_all(traced), traced)) return {};
  return journals_.record(traced);
}

}  // namespace clamor
