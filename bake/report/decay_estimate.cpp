#include "bake/report/decay_estimate.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "bake/trace/kernel_material.h"
#include "common/decay_curve.h"
#include "common/maths.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr std::size_t kPlaces = 4;
constexpr double kMinRoom_m = 0.2;
constexpr double kNearest_m = 0.1;  // minimum distance for 1 / r^2, as in the runtime
// Fewer photons per emitter give no estimate of their own.
constexpr std::uint64_t kCrowdPhotons = 1000;
constexpr std::size_t kCrowdGroups = 16;
constexpr double kDecibelsPerOctave = 10 / 3.321928094887362;

// Oblique directions, all different, so that no receiver lies on an axis of a room.
constexpr std::array<Vec3, kPlaces> kDirections = {Vec3(0.80, 0.13, 0.58), Vec3(-0.55, 0.21, 0.81),
                                                   Vec3(-0.83, -0.11, -0.55),
                                                   Vec3(0.51, 0.17, -0.84)};

// Levels of the decay curve at which its error is evaluated.
constexpr std::array<double, 7> kFallen_db = {0, 5, 10, 15, 20, 25, 30};

// (G - 1) / G times the sum of squared deviations from the mean.
double jackknife_variance(std::span<const double> without_one) {
  const auto count = static_cast<double>(without_one.size());
  double mean = 0, squares = 0;
  for (const double x : without_one) mean += x / count;
  for (const double x : without_one) squares += (x - mean) * (x - mean);
  return squares * (count - 1) / count;
}

}  // namespace

std::vector<DecayReceiver> decay_receivers(const Scene& scene,
                                           const std::vector<Emitter>& emitters) {
  std::vector<DecayReceiver> places;
  for (std::size_t i = 0; i < kPlaces && !emitters.empty(); ++i) {
    const auto emitter = static_cast<std::uint32_t>(i * emitters.size() / kPlaces);
    const Vec3 direction = normalize(kDirections[i]);
    const auto hit = scene.intersect(emitters[emitter].position_m, direction);
    if (hit && hit->distance_m > kMinRoom_m)
      places.push_back(
          {emitters[emitter].position_m + direction * (0.5 * hit->distance_m), emitter});
  }
  return places;
}

DecayEstimate::DecayEstimate(const Scene& scene, const Level& level, const TraceSettings& settings,
                             std::span<const std::uint64_t> photons, std::uint64_t stride)
    : scene_(scene),
      laws_(deposit_materials(level.materials)),
      air_loss_per_m_(settings.air_loss_per_m),
      speed_mps_(settings.speed_mps),
      longest_path_s_(settings.longest_path_s),
      photons_(photons.begin(), photons.end()),
      stride_(std::max<std::uint64_t>(1, stride)),
      progress_(level.emitters.size()) {
  for (const DecayReceiver& receiver : decay_receivers(scene, level.emitters)) {
    crowd_ |= level.emitters.size() > 1 && photons_[receiver.emitter] < kCrowdPhotons;
    receivers_.push_back({receiver, {}});
  }
  if (crowd_)
    for (Receiver& receiver : receivers_) receiver.groups.resize(kCrowdGroups);
}

std::uint64_t DecayEstimate::max_bytes(double longest_path_s) {
  const double steps = (longest_path_s + 1) / kStep_s;
  return static_cast<std::uint64_t>(steps) * kPlaces * kMaxGroups * sizeof(Energy);
}

bool DecayEstimate::wants(const PhotonRun& run) const {
  if (run.first / kRunPhotons % stride_ != 0 || photons_[run.emitter] == 0) return false;
  return std::any_of(receivers_.begin(), receivers_.end(), [&](const Receiver& receiver) {
    return crowd_ || receiver.at.emitter == run.emitter;
  });
}

void DecayEstimate::receive(std::span<const Deposit> deposits,
                            std::vector<ReceivedEnergy>& received) const {
  for (const Deposit& deposit : deposits) {
    const Vec3 normal(deposit.normal), mirror(deposit.mirror);
    const Vec3 place_m(deposit.position_m);
    const Vec3f from_m(scene_.away_from_surface(place_m, normal));
    for (std::size_t receiver = 0; receiver < receivers_.size(); ++receiver) {
      const Vec3& position_m = receivers_[receiver].at.position_m;
      if (!crowd_ && receivers_[receiver].at.emitter != deposit.emitter) continue;
      const Vec3 offset_m = position_m - place_m;
      const double r_m = length(offset_m);
      const double cos_o = r_m > 0 ? dot(offset_m, normal) / r_m : 0;
      if (!(cos_o > 0)) continue;
      const Vec3 direction = offset_m / r_m;
      const double arrival_s = deposit.delay_s + r_m / speed_mps_;
      if (!(arrival_s < longest_path_s_ + 1)) continue;
      if (scene_.is_occluded(from_m, Vec3f(position_m))) continue;

      ReceivedEnergy one{static_cast<std::uint32_t>(receiver), deposit.photon,
                         static_cast<std::uint32_t>(arrival_s / kStep_s),
                         laws_.density(deposit.material, dot(mirror, normal), cos_o,
                                       std::min(1.0, dot(direction, mirror)))};
      const double near_m = std::max(r_m, kNearest_m);
      const auto spread = static_cast<float>(1 / (near_m * near_m));
      const auto octaves_per_loss = static_cast<float>(r_m * std::numbers::log2e);
      for (std::size_t b = 0; b < kBandCount; ++b)
        one.energy[b] *=
            deposit.power[b] * spread * exp2_of(-air_loss_per_m_[b] * octaves_per_loss);
      received.push_back(one);
    }
  }
}

void DecayEstimate::merge_groups(std::uint32_t emitter) {
  progress_[emitter].units_per_group *= 2;
  for (Receiver& receiver : receivers_) {
    if (receiver.at.emitter != emitter) continue;
    receiver.groups.resize(kMaxGroups);
    for (std::size_t i = 0; i < kMaxGroups; ++i) {
      Histogram from = std::move(receiver.groups[i]);
      Histogram& to = receiver.groups[i / 2];
      if (i % 2 == 0) {
        to = std::move(from);
        continue;
      }
      to.resize(std::max(to.size(), from.size()));
      for (std::size_t step = 0; step < from.size(); ++step)
        for (std::size_t b = 0; b < kBandCount; ++b) to[step][b] += from[step][b];
    }
    for (std::size_t i = kMaxGroups / 2; i < kMaxGroups; ++i) receiver.groups[i].clear();
  }
}

void DecayEstimate::add(const PhotonRun& run, std::span<const ReceivedEnergy> received) {
  Progress& progress = progress_[crowd_ ? 0 : run.emitter];
  const std::uint64_t first_unit = progress.units;
  // An incomplete last unit is ignored.
  const std::uint64_t units = crowd_ ? 1 : run.count / kUnitPhotons;
  if (!crowd_)
    while ((first_unit + units + progress.units_per_group - 1) / progress.units_per_group >
           kMaxGroups)
      merge_groups(run.emitter);
  const double share = 1 / static_cast<double>(photons_[run.emitter]);
  for (const ReceivedEnergy& one : received) {
    const std::uint64_t unit = one.photon / kUnitPhotons;
    if (!crowd_ && unit >= units) continue;
    const std::uint64_t group =
        crowd_ ? first_unit % kCrowdGroups : (first_unit + unit) / progress.units_per_group;
    auto& groups = receivers_[one.receiver].groups;
    if (groups.size() <= group) groups.resize(group + 1);
    Histogram& histogram = groups[group];
    if (histogram.size() <= one.step) histogram.resize(one.step + 1);
    for (std::size_t b = 0; b < kBandCount; ++b)
      histogram[one.step][b] += share * static_cast<double>(one.energy[b]);
  }
  progress.units += units;
  if (crowd_) return;
  const std::uint64_t begun =
      (progress.units + progress.units_per_group - 1) / progress.units_per_group;
  for (Receiver& receiver : receivers_)
    if (receiver.at.emitter == run.emitter && receiver.groups.size() < begun)
      receiver.groups.resize(begun);
}

std::size_t DecayEstimate::whole_groups(const Receiver& receiver) const {
  const Progress& progress = progress_[crowd_ ? 0 : receiver.at.emitter];
  const std::uint64_t whole = crowd_ ? (progress.units >= kCrowdGroups ? kCrowdGroups : 0)
                                     : progress.units / progress.units_per_group;
  return std::min<std::size_t>(whole, receiver.groups.size());
}

// Backward integrals of all groups together (M. R. Schroeder, 1965), by step and one beyond.
std::vector<DecayEstimate::Energy> DecayEstimate::backward_integrals(
    std::span<const Histogram> groups) {
  std::size_t steps = 0;
  for (const Histogram& group : groups) steps = std::max(steps, group.size());
  std::vector<Energy> integrals(steps + 1, Energy{});
  for (std::size_t step = steps; step-- > 0;) {
    integrals[step] = integrals[step + 1];
    for (const Histogram& group : groups)
      if (step < group.size())
        for (std::size_t b = 0; b < kBandCount; ++b) integrals[step][b] += group[step][b];
  }
  return integrals;
}

std::optional<double> DecayEstimate::error_db() const {
  // The step at which the integral of a band has fallen to a level.
  struct Crossing {
    std::size_t step, band;
    std::vector<double> without_one_db;  // what is left there, by the group that is left out
  };
  double variance = 0, terms = 0;
  for (const Receiver& receiver : receivers_) {
    const std::span groups(receiver.groups.data(), whole_groups(receiver));
    if (groups.size() < kMinGroups) return std::nullopt;
    const std::vector<Energy> all = backward_integrals(groups);
    std::vector<Crossing> crossings;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      if (!(all[0][b] > 0)) continue;
      for (const double fallen_db : kFallen_db) {
        const double level = all[0][b] * exp2_of(-fallen_db / kDecibelsPerOctave);
        std::size_t step = fallen_db > 0 ? all.size() - 1 : 0;
        while (step > 0 && all[step][b] < level) --step;
        crossings.push_back({step, b, {}});
      }
    }
    std::ranges::stable_sort(crossings, std::ranges::greater{}, &Crossing::step);
    for (const Histogram& group : groups) {
      Energy left{};
      std::size_t step = all.size() - 1;
      for (Crossing& crossing : crossings) {
        while (step > crossing.step)
          if (--step < group.size())
            for (std::size_t b = 0; b < kBandCount; ++b) left[b] += group[step][b];
        const double rest = all[step][crossing.band] - left[crossing.band];
        if (!(rest > 0)) return std::nullopt;  // one group contains all the energy
        crossing.without_one_db.push_back(kDecibelsPerOctave * log2_of(rest));
      }
    }
    for (const Crossing& crossing : crossings) {
      variance += jackknife_variance(crossing.without_one_db);
      terms += 1;
    }
  }
  if (terms == 0) return std::nullopt;
  return std::sqrt(variance / terms / static_cast<double>(stride_));
}

std::optional<double> DecayEstimate::level_db(std::size_t index, std::size_t band,
                                              double time_s) const {
  const Receiver& receiver = receivers_[index];
  double energy = 0, all = 0;
  for (std::size_t i = 0; i < whole_groups(receiver); ++i) {
    for (std::size_t step = static_cast<std::size_t>(time_s / kStep_s);
         step < receiver.groups[i].size(); ++step)
      energy += receiver.groups[i][step][band];
    all += 1;
  }
  // Scaled to all photons of the emitter.
  const Progress& progress = progress_[crowd_ ? 0 : receiver.at.emitter];
  if (!crowd_)
    energy *= static_cast<double>(photons_[receiver.at.emitter]) /
              (all * static_cast<double>(progress.units_per_group * kUnitPhotons));
  if (!(energy > 0)) return std::nullopt;
  return kDecibelsPerOctave * log2_of(energy);
}

std::vector<std::optional<double>> DecayEstimate::t30s_s(const Receiver& receiver,
                                                         std::size_t band) const {
  const std::span groups(receiver.groups.data(), whole_groups(receiver));
  std::size_t steps = 0;
  for (const Histogram& group : groups) steps = std::max(steps, group.size());
  const auto add = [band](std::vector<double>& sum, const Histogram& group) {
    for (std::size_t step = 0; step < group.size(); ++step) sum[step] += group[step][band];
  };
  // Sums of the groups from one on, and of those before another: what is left without one in
  // between has no rounding of a difference.
  std::vector<std::vector<double>> from(groups.size() + 1, std::vector<double>(steps));
  for (std::size_t i = groups.size(); i-- > 0;) {
    from[i] = from[i + 1];
    add(from[i], groups[i]);
  }
  std::vector<double> before(steps);
  std::vector<EnergyStep> arrivals;
  std::vector<std::optional<double>> times_s(groups.size() + 1);
  for (std::size_t i = 0; i <= groups.size(); ++i) {  // the last round leaves out none
    arrivals.clear();
    const std::vector<double>& after = from[std::min(i + 1, groups.size())];
    for (std::size_t step = 0; step < steps; ++step)
      if (const double energy = before[step] + after[step]; energy > 0)
        arrivals.push_back({(static_cast<double>(step) + 0.5) * kStep_s, energy});
    if (!arrivals.empty())
      times_s[(i + 1) % times_s.size()] =
          DecayCurve(arrivals, arrivals.back().time_s).decay_time_s(-5, -35);
    if (i < groups.size()) add(before, groups[i]);
  }
  return times_s;
}

DecaySummary DecayEstimate::summary() const {
  DecaySummary summary;
  summary.places = static_cast<std::uint32_t>(receivers_.size());
  if (receivers_.empty()) return summary;
  summary.error_db = static_cast<float>(std::round(error_db().value_or(0) * 1e3) / 1e3);
  const auto milliseconds = [](double s) { return static_cast<float>(std::round(s * 1e3) / 1e3); };
  for (std::size_t b = 0; b < kBandCount; ++b) {
    std::vector<std::vector<std::optional<double>>> times_s;  // by receiver, see t30s_s()
    for (const Receiver& receiver : receivers_) times_s.push_back(t30s_s(receiver, b));
    // The mean over the receivers [first, last) of the i-th element, which most must have.
    const auto mean_s = [&times_s](std::size_t first, std::size_t last, std::size_t i) {
      double sum = 0;
      std::size_t known = 0;
      for (std::size_t r = first; r < last; ++r)
        if (const auto& time_s = times_s[r][i]) {
          sum += *time_s;
          ++known;
        }
      return 2 * known <= last - first ? std::nullopt
                                       : std::optional(sum / static_cast<double>(known));
    };
    const auto of_all_s = mean_s(0, receivers_.size(), 0);
    if (!of_all_s) continue;
    summary.t30_s[b] = milliseconds(*of_all_s);
    // Receivers of one emitter share its photons; those of different emitters are independent.
    double variance = 0;
    bool known = true;
    for (std::size_t first = 0, last = 0; first < receivers_.size(); first = last) {
      while (last < receivers_.size() &&
             (crowd_ || receivers_[last].at.emitter == receivers_[first].at.emitter))
        ++last;
      const std::size_t count = times_s[first].size() - 1;
      std::vector<double> without_one;
      for (std::size_t i = 1; i <= count && known; ++i) {
        const auto time_s = mean_s(first, last, i);
        known = time_s.has_value();
        if (known) without_one.push_back(*time_s);
      }
      if (count < kMinGroups || !known) {
        known = false;
        break;
      }
      const double weight =
          static_cast<double>(last - first) / static_cast<double>(receivers_.size());
      variance += weight * weight * jackknife_variance(without_one);
    }
    if (known) summary.t30_error_s[b] = std::max(1e-3f, milliseconds(std::sqrt(variance)));
  }
  return summary;
}

}  // namespace clamor
