#include "bake/received_paths.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "bake/bake_options.h"
#include "bake/kept_run.h"
#include "bake/mesh/mesh_preparation.h"
#include "bake/traced_state.h"
#include "common/decay_curve.h"
#include "common/material.h"
#include "common/maths.h"
#include "common/thin_material.h"
#include "common/thread_team.h"
#include "formats/level/mesh.h"

namespace clamor {

namespace {

constexpr double kFrom_db = -5;
constexpr std::size_t kGroups = 16;
constexpr std::uint32_t kUnitPhotons = 64;

bool can_change(const Material& material) {
  return !is_thin(material) &&
         std::ranges::all_of(material.absorption, [](float a) { return a >= 0 && a < 1; });
}

// Replaces energies by all that is left from each step on.
void integrate_backwards(std::vector<double>& energies) {
  for (std::size_t step = energies.size(); step-- > 1;) energies[step - 1] += energies[step];
}

// Slope of the line through values at equal distances, per step.
double slope_of(std::span<const double> values) {
  const double middle = (static_cast<double>(values.size()) - 1) / 2;
  double products = 0, squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double x = static_cast<double>(i) - middle;
    products += x * values[i], squares += x * x;
  }
  return squares > 0 ? products / squares : 0;
}

}  // namespace

FittedMaterials::FittedMaterials(const Mesh& mesh, std::span<const Material> materials) {
  std::vector<double> areas_m2(materials.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    areas_m2[mesh.materials[t]] += area_m2(mesh, t);
  for (std::size_t m = 0; m < areas_m2.size(); ++m) {
    const Material& material = materials[m];
    // A sidecar tells materials by their names.
    const bool is_known_by_name = std::ranges::all_of(materials, [&](const Material& other) {
      return other.name != material.name || other == material;
    });
    if (!(areas_m2[m] > 0) || !can_change(material) || !is_known_by_name) continue;
    const auto same = std::ranges::find(list, material.name, &FittedMaterial::name);
    if (same == list.end())
      list.push_back({material.name, areas_m2[m], material.absorption});
    else
      same->area_m2 += areas_m2[m];
    total_area_m2 += areas_m2[m];
  }
  std::ranges::stable_sort(list, std::greater(), &FittedMaterial::area_m2);
  for (const Material& material : materials) {
    const auto at = std::ranges::find(list, material.name, &FittedMaterial::name);
    of_level.push_back(at != list.end() ? static_cast<std::uint16_t>(at - list.begin()) : kFixed);
  }
}

ReceivedPaths::ReceivedPaths(const TracedState& state, std::size_t receivers,
                             std::span<const Material> materials, const FittedMaterials& fitted,
                             const BakeOptions& options)
    : receivers_(receivers) {
  for (std::size_t u = 0; u < fitted.list.size(); ++u) {
    const auto first = std::ranges::find(fitted.of_level, static_cast<std::uint16_t>(u));
    traced_.push_back(
        materials[static_cast<std::size_t>(first - fitted.of_level.begin())].absorption);
  }
  const DecayEstimate estimate = state.decay_estimate(false);
  std::vector<PhotonRun> wanted;
  for (const auto& batch : state.plan.batches())
    for (const PhotonRun& run : batch)
      if (estimate.wants(run)) wanted.push_back(run);
  runs_.resize(wanted.size());
  team_for(0, wanted.size(), [&](std::size_t i) {
    if (options.is_stopped()) return;
    TracedRuns traced;
    traced.record_paths();
    state.tracer.trace({&wanted[i], 1}, traced);
    const double share = 1 / static_cast<double>(state.plan.photons[wanted[i].emitter]);
    for (const KeptRun& kept : kept_runs(traced)) runs_[i] = receive(kept, estimate, share, fitted);
  });
  for (const RunPaths& run : runs_)
    for (const Path& path : run.paths)
      steps_ = std::max<std::size_t>(steps_, path.received.step + 1u);
}

ReceivedPaths::RunPaths ReceivedPaths::receive(const KeptRun& run, const DecayEstimate& estimate,
                                               double photon_share,
                                               const FittedMaterials& fitted) const {
  const std::size_t count = fitted.list.size();
  std::vector<std::uint16_t> met(run.paths.nodes.size() * count, 0);  // by node and fitted material
  for (std::size_t i = 0; i < run.paths.nodes.size(); ++i) {
    const PathNode& node = run.paths.nodes[i];
    if (node.before != PathNode::kNone)
      std::copy_n(&met[node.before * count], count, &met[i * count]);
    if (const std::uint16_t index = fitted.of_level[node.material];
        index != FittedMaterials::kFixed)
      ++met[i * count + index];
  }
  RunPaths result;
  std::vector<ReceivedEnergy> received;
  for (std::size_t d = 0; d < run.deposits.size(); ++d) {
    received.clear();
    estimate.receive({&run.deposits[d], 1}, received);
    for (ReceivedEnergy& one : received) {
      for (float& energy : one.energy) energy *= static_cast<float>(photon_share);
      const auto unit = static_cast<std::uint32_t>((run.run.first + one.photon) / kUnitPhotons);
      result.paths.push_back({one, static_cast<std::uint32_t>(unit % kGroups)});
      const auto at = met.begin() + static_cast<std::ptrdiff_t>(run.paths.deposits[d] * count);
      result.met.insert(result.met.end(), at, at + static_cast<std::ptrdiff_t>(count));
    }
  }
  return result;
}

std::optional<double> ReceivedPaths::time_s(std::span<const Steps> at_receivers,
                                            double to_db) const {
  double sum_s = 0;
  std::size_t known = 0;
  for (const Steps& energies : at_receivers) {
    std::vector<EnergyStep> arrivals;
    for (std::size_t step = 0; step < steps_; ++step)
      if (energies[step] > 0)
        arrivals.push_back(
            {(static_cast<double>(step) + 0.5) * DecayEstimate::kStep_s, energies[step]});
    if (arrivals.empty()) continue;
    const auto time = DecayCurve(arrivals, arrivals.back().time_s).decay_time_s(kFrom_db, to_db);
    if (time) sum_s += *time, ++known;
  }
  if (known == 0 || 2 * known < at_receivers.size()) return std::nullopt;
  return sum_s / static_cast<double>(known);
}

ReceivedPaths::Decay ReceivedPaths::decay(std::size_t band, std::span<const double> absorptions,
                                          double to_db) const {
  const std::size_t count = absorptions.size();
  std::vector<double> logs(count);
  for (std::size_t u = 0; u < count; ++u)
    logs[u] = log2_of((1 - absorptions[u]) / (1 - static_cast<double>(traced_[u][band])));
  // Sums over paths by receiver and step: energies, their squares, those of each group, and
  // energies times reflections.
  std::vector<Steps> energies(receivers_, Steps(steps_)), squares = energies;
  std::vector<Steps> by_group(receivers_ * kGroups, Steps(steps_)),
      met(receivers_ * count, Steps(steps_));
  for (const RunPaths& run : runs_)
    for (std::size_t p = 0; p < run.paths.size(); ++p) {
      const Path& path = run.paths[p];
      const std::span times(&run.met[p * count], count);
      double log = 0;
      for (std::size_t u = 0; u < count; ++u) log += times[u] * logs[u];
      const double energy = static_cast<double>(path.received.energy[band]) * exp2_of(log);
      const std::size_t r = path.received.receiver, step = path.received.step;
      energies[r][step] += energy;
      squares[r][step] += energy * energy;
      by_group[r * kGroups + path.group][step] += energy;
      for (std::size_t u = 0; u < count; ++u) met[r * count + u][step] += times[u] * energy;
    }

  Decay decay;
  decay.slopes.assign(count, 0);
  decay.time_s = time_s(energies, to_db);
  if (!decay.time_s) return decay;
  double mean = 0, all = 0;
  std::vector<double> without_one;
  for (std::size_t g = 0; g < kGroups; ++g) {
    std::vector<Steps> rest = energies;
    for (std::size_t r = 0; r < receivers_; ++r)
      for (std::size_t s = 0; s < steps_; ++s)
        rest[r][s] = std::max(rest[r][s] - by_group[r * kGroups + g][s], 0.0);
    if (const auto time = time_s(rest, to_db)) without_one.push_back(*time), mean += *time;
  }
  mean /= static_cast<double>(std::max<std::size_t>(1, without_one.size()));
  for (const double time : without_one) all += (time - mean) * (time - mean);
  decay.error_s = std::sqrt(all * (1 - 1.0 / kGroups));

  double weights = 0;
  for (std::size_t r = 0; r < receivers_; ++r) {
    Steps left = energies[r], left_squares = squares[r];
    integrate_backwards(left);
    integrate_backwards(left_squares);
    if (!(left[0] > 0)) continue;
    const auto crossing = [&](double db) {
      const double level = left[0] * power(10, db / 10);
      return static_cast<std::size_t>(
          std::ranges::find_if(left, [&](double e) { return e < level; }) - left.begin());
    };
    const std::size_t first = crossing(kFrom_db), end = crossing(to_db);
    if (end == steps_ || end < first + 3) continue;
    const double effective = left_squares[end] > 0 ? left[end] * left[end] / left_squares[end] : 0;
    decay.effective = weights > 0 ? std::min(decay.effective, effective) : effective;
    std::vector<double> logarithms;
    for (std::size_t s = first; s < end; ++s)
      logarithms.push_back(log2_of(left[s]) / std::numbers::log2e);
    const double slope = slope_of(logarithms);
    for (std::size_t u = 0; u < count; ++u) {
      Steps& reflections = met[r * count + u];
      integrate_backwards(reflections);
      std::vector<double> shares;
      for (std::size_t s = first; s < end; ++s)
        shares.push_back(-reflections[s] / left[s] / (1 - absorptions[u]));
      decay.slopes[u] += -slope_of(shares) / slope;
    }
    weights += 1;
  }
  for (double& slope : decay.slopes) slope /= std::max(weights, 1.0);
  return decay;
}

}  // namespace clamor
