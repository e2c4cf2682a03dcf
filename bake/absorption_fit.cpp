#include "bake/absorption_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <numbers>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "bake/bake_options.h"
#include "bake/kept_run.h"
#include "bake/mesh/mesh_preparation.h"
#include "bake/report/decay_estimate.h"
#include "bake/traced_state.h"
#include "common/decay_curve.h"
#include "common/maths.h"
#include "common/text.h"
#include "common/thin_material.h"
#include "common/thread_team.h"
#include "common/utf8_path.h"
#include "formats/files/atomic_file.h"
#include "formats/files/json.h"
#include "formats/level/acoustic_values.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr double kFrom_db = -5;
constexpr int kRounds = 6, kMaxTraces = 3;
constexpr double kGoodEnough = 1e-3, kTolerance = 0.01;  // relative differences of times
constexpr double kMinEffective = 64;                     // as PathCache::kMinDeposits
constexpr std::size_t kGroups = 16;
constexpr std::uint32_t kUnitPhotons = 64;
constexpr std::uint16_t kFixed = 0xffff;

// The materials of one name, whose absorption is looked for.
struct Unknown {
  std::string name;
  double area_m2 = 0;
  Bands absorption{};  // of the level
};

struct Unknowns {
  std::vector<Unknown> list;            // largest area first
  std::vector<std::uint16_t> of_level;  // by material, its index in the list or kFixed
  double area_m2 = 0;
};

bool can_change(const Material& material) {
  return !is_thin(material) &&
         std::ranges::all_of(material.absorption, [](float a) { return a >= 0 && a < 1; });
}

Unknowns unknowns_of(const Level& level) {
  std::vector<double> areas_m2(level.materials.size(), 0);
  for (std::size_t t = 0; t < level.mesh.triangles.size(); ++t)
    areas_m2[level.mesh.materials[t]] += area_m2(level.mesh, t);
  Unknowns unknowns;
  for (std::size_t m = 0; m < areas_m2.size(); ++m) {
    const Material& material = level.materials[m];
    if (!(areas_m2[m] > 0) || !can_change(material)) continue;
    const auto same = std::ranges::find(unknowns.list, material.name, &Unknown::name);
    if (same == unknowns.list.end())
      unknowns.list.push_back({material.name, areas_m2[m], material.absorption});
    else if (same->absorption == material.absorption)
      same->area_m2 += areas_m2[m];
    unknowns.area_m2 += areas_m2[m];
  }
  std::ranges::stable_sort(unknowns.list, std::greater(), &Unknown::area_m2);
  for (const Material& material : level.materials) {
    const auto at = std::ranges::find(unknowns.list, material.name, &Unknown::name);
    const bool is_one =
        at != unknowns.list.end() && at->absorption == material.absorption && can_change(material);
    unknowns.of_level.push_back(is_one ? static_cast<std::uint16_t>(at - unknowns.list.begin())
                                       : kFixed);
  }
  return unknowns;
}

// What traced paths bring to the receivers of a decay estimate, and which materials they met.
class ReceivedPaths {
 public:
  // `level` has the absorptions that are traced.
  ReceivedPaths(const Level& level, const BakeOptions& options, const Unknowns& unknowns);

  // A decay time in one octave with other absorptions, and its derivatives.
  struct Decay {
    std::optional<double> time_s;  // mean over receivers, where most have one
    double error_s = 0;
    double effective = 0;        // paths that carry the end of the range, if they were alike
    std::vector<double> slopes;  // d ln time / d absorption, by unknown
  };
  Decay decay(std::size_t band, std::span<const double> absorptions, double to_db) const;

  std::size_t receivers() const { return receivers_; }
  double traced(std::size_t unknown, std::size_t band) const { return traced_[unknown][band]; }

 private:
  struct Path {
    ReceivedEnergy received;
    std::uint32_t group = 0;
  };
  struct RunPaths {
    std::vector<Path> paths;
    std::vector<std::uint16_t> met;  // by path and unknown: how often
  };
  using Steps = std::vector<double>;

  RunPaths receive(const KeptRun& run, const DecayEstimate& estimate, double photon_share,
                   const Unknowns& unknowns) const;
  std::optional<double> time_s(std::span<const Steps> at_receivers, double to_db) const;

  std::vector<RunPaths> runs_;  // in the order of the plan
  std::vector<Bands> traced_;
  std::size_t receivers_ = 0, steps_ = 0;
};

ReceivedPaths::ReceivedPaths(const Level& level, const BakeOptions& options,
                             const Unknowns& unknowns) {
  for (std::size_t u = 0; u < unknowns.list.size(); ++u) {
    const auto first = std::ranges::find(unknowns.of_level, static_cast<std::uint16_t>(u));
    traced_.push_back(
        level.materials[static_cast<std::size_t>(first - unknowns.of_level.begin())].absorption);
  }
  BakeSettings settings = options.settings;
  settings.early_order = 0;  // all reflections leave deposits
  const TracedState state(level, settings);
  const DecayEstimate estimate = state.decay_estimate(false);
  receivers_ = decay_receivers(state.scene, level.emitters).size();
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
    for (const KeptRun& kept : kept_runs(traced))
      runs_[i] = receive(kept, estimate, share, unknowns);
  });
  for (const RunPaths& run : runs_)
    for (const Path& path : run.paths)
      steps_ = std::max<std::size_t>(steps_, path.received.step + 1u);
}

ReceivedPaths::RunPaths ReceivedPaths::receive(const KeptRun& run, const DecayEstimate& estimate,
                                               double photon_share,
                                               const Unknowns& unknowns) const {
  const std::size_t count = unknowns.list.size();
  std::vector<std::uint16_t> met(run.paths.nodes.size() * count, 0);  // by node and unknown
  for (std::size_t i = 0; i < run.paths.nodes.size(); ++i) {
    const PathNode& node = run.paths.nodes[i];
    if (node.before != PathNode::kNone)
      std::copy_n(&met[node.before * count], count, &met[i * count]);
    if (const std::uint16_t unknown = unknowns.of_level[node.material]; unknown != kFixed)
      ++met[i * count + unknown];
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

// One octave.
class OctaveFit {
 public:
  OctaveFit(const Unknowns& unknowns, std::size_t band, double measured_s, double to_db)
      : band_(band), measured_s_(measured_s), to_db_(to_db) {
    for (const Unknown& unknown : unknowns.list) {
      ranges_.push_back(AbsorptionRange::of(static_cast<double>(unknown.absorption[band])));
      shares_.push_back(unknown.area_m2 / unknowns.area_m2);
      absorptions_.push_back(ranges_.back().known);
    }
  }

  // Finds the absorptions by which these paths give the measured time.
  void run(const ReceivedPaths& paths) {
    for (int round = 0;; ++round) {
      now_ = paths.decay(band_, absorptions_, to_db_);
      if (!before_s_) before_s_ = now_.time_s;
      if (!now_.time_s || round == kRounds || std::abs(difference()) < kGoodEnough) return;
      auto next = step();
      if (next == absorptions_) return;
      absorptions_ = std::move(next);
    }
  }

  const std::vector<double>& absorptions() const { return absorptions_; }

  // ln(measured time / that of the paths)
  double difference() const { return log2_of(measured_s_ / *now_.time_s) / std::numbers::log2e; }
  const ReceivedPaths::Decay& decay() const { return now_; }
  AbsorptionFit::Octave octave() const {
    return {measured_s_, before_s_.value_or(0), now_.time_s.value_or(0), now_.error_s};
  }

 private:
  // The least deviation from what is known by which the rate of the decay is the measured one. To
  // first order: 1 / T is nearly linear in absorptions.
  std::vector<double> step() const {
    const auto at = [&](double multiplier) {
      std::vector<double> next;
      for (std::size_t m = 0; m < absorptions_.size(); ++m) {
        const AbsorptionRange& range = ranges_[m];
        const double variance = range.deviation * range.deviation / shares_[m];
        next.push_back(std::clamp(range.known - multiplier * variance * now_.slopes[m], range.least,
                                  range.most));
      }
      return next;
    };
    const auto is_too_fast = [&](double multiplier) {
      const std::vector<double> next = at(multiplier);
      double change = 0;  // of 1 / T, relative
      for (std::size_t m = 0; m < next.size(); ++m)
        change -= now_.slopes[m] * (next[m] - absorptions_[m]);
      return change >= *now_.time_s / measured_s_ - 1;
    };
    double low = -1, high = 1;
    for (int i = 0; i < 60 && is_too_fast(low); ++i) low *= 2;
    for (int i = 0; i < 60 && !is_too_fast(high); ++i) high *= 2;
    for (int i = 0; i < 100; ++i) (is_too_fast((low + high) / 2) ? high : low) = (low + high) / 2;
    return at(high);
  }

  std::size_t band_;
  double measured_s_, to_db_;
  std::vector<AbsorptionRange> ranges_;
  std::vector<double> shares_;  // of the area
  std::vector<double> absorptions_;
  ReceivedPaths::Decay now_;
  std::optional<double> before_s_;
};

// Rounded to what a sidecar says.
float rounded(double absorption) { return static_cast<float>(std::round(1e4 * absorption) / 1e4); }

// Why an octave cannot be fitted, or "".
std::string refusal(const OctaveFit& fit, const MeasuredDecay& measured, std::size_t band) {
  const AbsorptionFit::Octave octave = fit.octave();
  if (!fit.decay().time_s)
    return fmt::format("at {} Hz the level is too open or too dry for a {}", kBandCentres_hz[band],
                       measured.name());
  if (std::abs(fit.difference()) < kTolerance) return "";
  return fmt::format(
      "at {} Hz no absorption within its bounds gives the measured {} of {:.2f} s; with all "
      "materials at their {}, it is {:.2f} s",
      kBandCentres_hz[band], measured.name(), octave.measured_s,
      fit.difference() > 0 ? "least" : "most", octave.after_s);
}

Result<AbsorptionFit> fit_on_this_team(const Level& level, const BakeOptions& options,
                                       const MeasuredDecay& measured) {
  const Unknowns unknowns = unknowns_of(level);
  if (unknowns.list.empty())
    return Error(
        "no material's absorption can be fitted: thin ones and open ones stay as they are");
  std::array<std::optional<OctaveFit>, kBandCount> octaves;
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (measured.times_s[b]) octaves[b].emplace(unknowns, b, *measured.times_s[b], measured.to_db);
  Level traced = level;
  AbsorptionFit fit;
  for (bool carries = false; !carries && fit.traces < kMaxTraces; ++fit.traces) {
    const ReceivedPaths paths(traced, options, unknowns);
    if (options.is_stopped()) return Error("stopped");
    if (paths.receivers() == 0)
      return Error("no surface is near the emitters, so that there is no decay to fit");
    team_for(0, kBandCount, [&](std::size_t b) {
      if (octaves[b]) octaves[b]->run(paths);
    });
    carries = true;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      if (!octaves[b]) continue;
      carries = carries && octaves[b]->decay().effective >= kMinEffective;
      const std::vector<double> found = octaves[b]->absorptions();
      for (std::size_t m = 0; m < traced.materials.size(); ++m)
        if (const std::uint16_t unknown = unknowns.of_level[m]; unknown != kFixed)
          traced.materials[m].absorption[b] = static_cast<float>(found[unknown]);
    }
  }
  std::string reasons;
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (octaves[b])
      if (const std::string reason = refusal(*octaves[b], measured, b); !reason.empty())
        reasons += (reasons.empty() ? "" : "; ") + reason;
  if (!reasons.empty())
    return Error(reasons +
                 ". Correct the measured times or leave these octaves out, or give the "
                 "materials other presets");
  for (std::size_t u = 0; u < unknowns.list.size(); ++u) {
    const Unknown& unknown = unknowns.list[u];
    AbsorptionFit::Surface surface{unknown.name, unknown.area_m2, unknown.absorption,
                                   unknown.absorption};
    for (std::size_t b = 0; b < kBandCount; ++b) {
      if (!octaves[b]) continue;
      const double found = octaves[b]->absorptions()[u];
      surface.after[b] = rounded(found);
      surface.slope_s[b] = *octaves[b]->decay().time_s * octaves[b]->decay().slopes[u];
      fit.octaves[b] = octaves[b]->octave();
    }
    fit.surfaces.push_back(std::move(surface));
  }
  return fit;
}

Json list_of(const Bands& bands) {
  Json::Array list;
  for (const float value : bands)
    list.emplace_back(std::round(1e6 * static_cast<double>(value)) / 1e6);
  return Json(std::move(list));
}

}  // namespace

AbsorptionRange AbsorptionRange::of(double absorption) {
  AbsorptionRange range;
  range.known = std::clamp(absorption, kLeastAbsorption / 2, kMostAbsorption);
  range.deviation = kAbsorptionError + kRelativeAbsorptionError * range.known;
  const double most = kAbsorptionDeviations * range.deviation;
  // A table may give less than can be measured.
  range.least = std::max(range.known - most, std::min(kLeastAbsorption, range.known));
  range.most = std::min(range.known + most, kMostAbsorption);
  return range;
}

Result<MeasuredDecay> MeasuredDecay::read(const std::string& path) {
  const auto json = read_json(path);
  if (!json.ok()) return json.error();
  JsonFields fields(*json, path);
  for (const char* other : {"by", "source", "receiver", "edt_s", "c80_db", "d50", "ts_s", "g_db"})
    fields.any(other);
  const auto hz = fields.numbers("bandsHz").value_or(
      std::vector(kBandCentres_hz.begin(), kBandCentres_hz.end()));
  const auto t30_s = fields.numbers("t30_s"), t20_s = fields.numbers("t20_s");
  MeasuredDecay measured;
  measured.to_db = t30_s ? -35 : -25;
  const auto& times_s = t30_s ? t30_s : t20_s;
  if (!times_s)
    fields.fail("needs 't30_s' or 't20_s', the measured reverberation times");
  else if (times_s->size() != hz.size())
    fields.fail(
        fmt::format("'{}' must have a value for each of 'bandsHz'", t30_s ? "t30_s" : "t20_s"));
  else if (std::ranges::any_of(*times_s, [](double s) { return !(s > 0 && s < 100); }))
    fields.fail("has a time that is not above 0 and below 100 seconds");
  else
    measured.times_s = octave_means(hz, *times_s);
  if (auto read = fields.result_without_unknown(); !read.ok()) return read.error();
  if (std::ranges::none_of(measured.times_s, [](const auto& time) { return time.has_value(); }))
    return Error(path + ": has no value at the centre of an octave from 63 to 8000 Hz");
  return measured;
}

Result<AbsorptionFit> fit_absorption(const Level& level, const BakeOptions& options,
                                     const MeasuredDecay& measured) {
  if (level.emitters.empty()) return Error("the level has no emitter, so there is no decay to fit");
  Result<AbsorptionFit> fit = Error("");
  with_team(options.threads, [&] { fit = fit_on_this_team(level, options, measured); });
  return fit;
}

Result<void> write_fitted_sidecar(const std::string& path, const std::string& earlier,
                                  const Level& level, const AbsorptionFit& fit) {
  Json::Object materials, others;
  for (const AbsorptionFit::Surface& surface : fit.surfaces) {
    const auto of_level = std::ranges::find_if(level.materials, [&](const Material& material) {
      return material.name == surface.name && material.absorption == surface.before;
    });
    Json::Object values;
    values.emplace_back("absorption", list_of(surface.after));
    // A lobe without scattering would mean that there is none, and a mirror is what none means.
    values.emplace_back("scattering", list_of(of_level->scattering));
    if (std::ranges::min(of_level->phong) < kMirrorExponent) {
      Bands phong = of_level->phong;
      for (float& exponent : phong) exponent = std::min(exponent, kSharpestLobe);
      values.emplace_back("phong", list_of(phong));
    }
    if (sum_of(of_level->transmission) > 0)
      values.emplace_back("transmission", list_of(of_level->transmission));
    materials.emplace_back(surface.name, Json(std::move(values)));
  }
  std::error_code none;
  if (std::filesystem::exists(path_of(earlier), none)) {
    auto json = read_json(earlier);
    if (!json.ok()) return json.error();
    for (auto& [key, value] : *json->object())
      if (key != "materials")
        others.emplace_back(key, value);
      else if (value.object() != nullptr)  // the first rule that matches applies
        for (auto& rule : *value.object())
          if (std::ranges::find(fit.surfaces, rule.first, &AbsorptionFit::Surface::name) ==
              fit.surfaces.end())
            materials.push_back(std::move(rule));
  }
  others.emplace_back("materials", Json(std::move(materials)));
  return write_file(path, dump_json(Json(std::move(others))) + "\n");
}

}  // namespace clamor
