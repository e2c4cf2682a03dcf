#include "bake/bake_plan.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "bake/bake_options.h"
#include "bake/report/decay_estimate.h"
#include "bake/trace/pilot.h"
#include "bake/traced_state.h"
#include "common/maths.h"
#include "common/thread_team.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr double kSourcesPerRoom = 200'000;
// A hundred emitters that do not see each other, as in a valley, would otherwise make a level of a
// million triangles cost more than a minute and 2 GB.
constexpr std::uint32_t kMaxRooms = 32;
constexpr double kDepositsPerSource = 4;         // default without --photons
constexpr double kKeptDepositsPerSource = 1.25;  // before the final, exact thinning
constexpr std::uint64_t kMaxPhotons = 4'000'000'000;

// Coarse rounding keeps the plan constant while an emitter moves a little, so that the journal
// stays valid.
double one_digit_up(double value) {
  double step = 1;
  while (value / step >= 10) step *= 10;
  return std::ceil(value / step) * step;
}

bool are_within(const Bands& values, const Bands& others, float factor) {
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (values[b] > factor * others[b] || others[b] > factor * values[b]) return false;
  return true;
}

// Takes whole steps of 5 s, so that the plan stays the same as emitters move a little.
void plan_longest_path(double asked_s, double needed_s, BakePlan& plan) {
  constexpr double kStep_s = 5, kFadingShare = 0.2;
  plan.longest_path_s = asked_s > 0 ? asked_s
                                    : std::clamp(std::ceil(needed_s / kStep_s) * kStep_s,
                                                 kUsualPath_s, kLongestPath_s);
  plan.fade_s = needed_s > plan.longest_path_s ? kFadingShare * plan.longest_path_s : 0;
}

std::string in_megabytes(std::uint64_t bytes) {
  return std::to_string((bytes + 999'999) / 1'000'000) + " MB";
}

}  // namespace

std::uint64_t BakePlan::all_photons() const {
  return std::accumulate(photons.begin(), photons.end(), std::uint64_t{0});
}

std::vector<std::vector<PhotonRun>> BakePlan::batches() const {
  std::vector<std::vector<PhotonRun>> batches;
  std::uint64_t filled = kRunPhotons;
  for (std::uint32_t emitter = 0; emitter < photons.size(); ++emitter)
    for (std::uint64_t first = 0; first < photons[emitter]; first += kRunPhotons) {
      const auto count = static_cast<std::uint32_t>(
          std::min<std::uint64_t>(kRunPhotons, photons[emitter] - first));
      if (filled + count > kRunPhotons) {
        batches.emplace_back();
        filled = 0;
      }
      batches.back().push_back({emitter, first, count});
      filled += count;
    }
  return batches;
}

std::uint64_t bake_memory_bytes(const Level& level, const BakePlan& plan, int threads,
                                SortStorage sorted) {
  constexpr std::uint64_t kProgram = 65'000'000, kPerTriangle = 300;
  // On disk, the steps take what the limit leaves, at least this much.
  const std::uint64_t in_memory = kBytesPerSource * plan.sources;
  const std::uint64_t for_sources =
      sorted == SortStorage::kMemory ? in_memory : std::min<std::uint64_t>(in_memory, 40'000'000);
  constexpr std::uint64_t kPerEmitter = 1000, kPerThread = 8'000'000;
  std::uint64_t samples = 0;
  for (const Signal& signal : level.signals) samples += signal.samples.size();
  return kProgram + kPerTriangle * level.mesh.triangles.size() + for_sources +
         kPerEmitter * level.emitters.size() + 8 * samples +
         kBytesPerRun * (plan.all_photons() / kRunPhotons) +
         kPerThread * static_cast<std::uint64_t>(threads) +
         DecayEstimate::max_bytes(plan.longest_path_s);
}

Result<SortPlace> check_memory(const Level& level, BakePlan plan, const BakeOptions& options) {
  if (has_closed_state(level)) plan.sources *= 2;
  const int threads = team_size();
  const auto needs = [&](const BakePlan& of, SortStorage sorted) {
    return bake_memory_bytes(level, of, threads, sorted);
  };
  if (options.memory_bytes == 0 || needs(plan, SortStorage::kMemory) <= options.memory_bytes)
    return SortPlace{};
  const SortStorage last = options.spill.empty() ? SortStorage::kMemory : SortStorage::kFiles;
  const std::uint64_t needed = needs(plan, last);
  // The steps get most of what the smallest of them leave.
  constexpr std::uint64_t kMinStepBytes = 25'000'000;
  if (needed <= options.memory_bytes)
    return SortPlace{last, kMinStepBytes + (options.memory_bytes - needed) / 10 * 6};
  BakePlan bare = plan;
  bare.sources = 0;
  const std::uint64_t least = needs(bare, last);
  const std::string advice =
      least < options.memory_bytes
          ? "--sources " + std::to_string((options.memory_bytes - least) / kBytesPerSource) +
                " would fit"
          : "the level itself needs " + in_megabytes(least);
  return Error("the bake needs about " + in_megabytes(needed) + " of memory, more than the " +
               in_megabytes(options.memory_bytes) + " it may have; " + advice);
}

std::uint64_t shard_memory_bytes(const Level& level, BakePlan plan, int threads) {
  plan.sources = 0;
  return bake_memory_bytes(level, plan, threads);
}

Result<void> check_shard_memory(const Level& level, const BakePlan& plan,
                                const BakeOptions& options) {
  const std::uint64_t needed = shard_memory_bytes(level, plan, team_size());
  if (options.memory_bytes == 0 || needed <= options.memory_bytes) return {};
  return Error("a shard needs about " + in_megabytes(needed) + " of memory, more than the " +
               in_megabytes(options.memory_bytes) + " it may have");
}

std::uint32_t emitter_rooms(const Scene& scene, const Level& level) {
  constexpr std::size_t kMaxFound = 64;
  std::vector<std::size_t> parent;  // union-find over the rooms found so far
  std::vector<Vec3> place;          // one emitter position per room
  const auto root_of = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const Emitter& emitter : level.emitters) {
    std::size_t room = parent.size();
    for (std::size_t i = 0; i < place.size(); ++i) {
      if (room < parent.size() && root_of(i) == root_of(room)) continue;
      if (!scene.see_each_other(place[i], emitter.position_m)) continue;
      if (room == parent.size())
        room = i;
      else
        parent[root_of(i)] = root_of(room);
    }
    if (room == parent.size() && parent.size() < kMaxFound) {
      parent.push_back(room);
      place.push_back(emitter.position_m);
    }
  }
  std::uint32_t rooms = 0;
  for (std::size_t i = 0; i < parent.size(); ++i) rooms += root_of(i) == i ? 1 : 0;
  return std::max(rooms, 1u);
}

TraceSettings trace_settings(const BakeSettings& settings) {
  TraceSettings trace;
  trace.seed = settings.seed;
  trace.roulette_exponent = settings.roulette_exponent;
  trace.speed_mps = speed_of_sound_mps(settings.air);
  trace.air_loss_per_m = air_loss_per_m(settings.air);
  return trace;
}

BakePlan make_bake_plan(const Scene& scene, const Level& level, const BakeSettings& settings,
                        const TraceSettings& trace) {
  BakePlan plan;
  plan.rooms = emitter_rooms(scene, level);
  const double sources = settings.sources > 0 ? static_cast<double>(settings.sources)
                                              : kSourcesPerRoom * std::min(plan.rooms, kMaxRooms);
  plan.sources = static_cast<std::uint64_t>(std::min<double>(sources, kMaxSources));

  std::vector<double> power;
  for (const Emitter& emitter : level.emitters) power.push_back(emitted_power(emitter));
  const double total = std::accumulate(power.begin(), power.end(), 0.0);

  TraceSettings of_pilot = trace;
  of_pilot.longest_path_s = settings.longest_path_s > 0 ? settings.longest_path_s : kUsualPath_s;
  Pilot pilot = trace_pilot(scene, level, of_pilot);
  plan.decay = pilot.decay;
  plan_longest_path(settings.longest_path_s, pilot.decay_path_m / trace.speed_mps, plan);
  if (plan.longest_path_s > of_pilot.longest_path_s) {
    of_pilot.longest_path_s = plan.longest_path_s;
    lengthen_pilot(scene, level, of_pilot, pilot);
  }
  const double per_photon = std::max(1.0, pilot.deposits_per_photon());
  double photons = static_cast<double>(settings.photons);
  if (settings.photons == 0)
    photons = std::clamp(one_digit_up(kDepositsPerSource * sources / per_photon), 1000.0,
                         static_cast<double>(kMaxPhotons));
  if (scene.is_empty()) photons = 0;  // no surfaces to hit
  plan.wanted_photons = static_cast<std::uint64_t>(photons);
  for (const double emitted : power) {
    const double wanted = total > 0 ? std::round(emitted / total * photons) : 0;
    plan.photons.push_back(
        emitted > 0 && photons > 0 ? std::max(kMinPhotons, static_cast<std::uint64_t>(wanted)) : 0);
  }
  plan.deposits = std::min(per_photon * static_cast<double>(plan.all_photons()),
                           kKeptDepositsPerSource * sources);
  plan.deposit_threshold =
      pilot.threshold(static_cast<double>(plan.all_photons()), kKeptDepositsPerSource * sources);
  return plan;
}

void keep_estimates(BakePlan& plan, const BakePlan& earlier) {
  constexpr double kThresholdStep = 1.0001 * Pilot::kThresholdStep;
  constexpr float kDecayStep = 1.51f;   // decay_model() rounds to 1, 1.5, 2, 3, ...
  if (plan.longest_path_s != earlier.longest_path_s || plan.fade_s != earlier.fade_s ||
      plan.deposit_threshold > kThresholdStep * earlier.deposit_threshold ||
      earlier.deposit_threshold > kThresholdStep * plan.deposit_threshold ||
      !are_within(plan.decay.early_m, earlier.decay.early_m, kDecayStep) ||
      !are_within(plan.decay.knee_m, earlier.decay.knee_m, kDecayStep) ||
      !are_within(plan.decay.late_m, earlier.decay.late_m, kDecayStep))
    return;
  plan.deposit_threshold = earlier.deposit_threshold;
  plan.decay = earlier.decay;
}

}  // namespace clamor
