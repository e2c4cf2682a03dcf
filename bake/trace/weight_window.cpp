#include "bake/trace/weight_window.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bake/trace/deposit.h"
#include "common/maths.h"
#include "common/random.h"

namespace clamor {

namespace {

constexpr float kSplitAbove = 2, kEndBelow = 0.5f;
constexpr std::uint32_t kMostCopies = 8;  // of one photon at a time
// Photons below this share of the decay are left alone, so that a wrong estimate costs little.
constexpr float kLeastEnergy_log2 = -23;  // -70 dB
// Runs of fewer photons, as those of a crowd, have no slots for copies, and are left alone.
constexpr std::uint32_t kLeastRun = 64;
constexpr double kKneeShare = 0.9;  // of a band's energy arrives before the knee

float log2e() { return std::numbers::log2e_v<float>; }

// Rounds to a digit and a half: 1, 1.5, 2, 3, 4, 5, 6, 8, 10, ...
float rounded(double value) {
  static constexpr std::array kSteps = {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0};
  if (!(value > 0)) return 0;
  double scale = 1;
  while (value >= 10 * scale) scale *= 10;
  while (value < scale) scale /= 10;
  double nearest = kSteps[0];
  for (const double step : kSteps)
    if (std::abs(value / scale - step) < std::abs(value / scale - nearest)) nearest = step;
  return static_cast<float>(nearest * scale);
}

}  // namespace

float DecayModel::log2_energy(std::size_t band, float path_m) const {
  const float before_m = std::min(path_m, knee_m[band]);
  return -log2e() * (before_m / early_m[band] + (path_m - before_m) / late_m[band]);
}

DecayModel decay_model(std::span<const Deposit> deposits, double speed_mps) {
  DecayModel model;
  struct Arrival {
    float path_m, power;
  };
  std::vector<Arrival> arrivals(deposits.size());
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double sum = 0, moment_m = 0;
    for (std::size_t i = 0; i < deposits.size(); ++i) {
      arrivals[i] = {static_cast<float>(deposits[i].delay_s * speed_mps), deposits[i].power[b]};
      sum += static_cast<double>(arrivals[i].power);
      moment_m += static_cast<double>(arrivals[i].power) * arrivals[i].path_m;
    }
    if (!(sum > 0)) return {};
    std::stable_sort(arrivals.begin(), arrivals.end(),
                     [](const Arrival& a, const Arrival& c) { return a.path_m < c.path_m; });
    double passed = 0, knee_m = 0, late = 0, late_moment_m = 0;
    for (const Arrival& arrival : arrivals) {
      if (passed < kKneeShare * sum) knee_m = arrival.path_m;
      passed += static_cast<double>(arrival.power);
      if (passed < kKneeShare * sum) continue;
      late += static_cast<double>(arrival.power);
      late_moment_m += static_cast<double>(arrival.power) * (arrival.path_m - knee_m);
    }
    model.early_m[b] = rounded(moment_m / sum);
    model.knee_m[b] = rounded(knee_m);
    // A late decay is never taken to be faster than the early one.
    model.late_m[b] = std::max(model.early_m[b], rounded(late > 0 ? late_moment_m / late : 0));
    if (!(model.early_m[b] > 0)) return {};
  }
  return model;
}

// w n, or a value that leaves the photon alone.
float WeightWindow::importance(const KernelPhoton& photon, const Bands& emitted) const {
  const auto path_m = static_cast<float>(photon.travelled_m);
  float weight = 0, share = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float log2_energy = decay_.log2_energy(b, path_m);
    if (log2_energy < kLeastEnergy_log2) return 1;
    if (emitted[b] > 0)
      weight += photon.power[b] * photon.weight[b] / (emitted[b] * exp2_of(log2_energy));
    share += exp2_of(roulette_exponent_ * log2_energy);
  }
  return weight * share / (kBandCount * kBandCount);
}

void WeightWindow::begin_bounce(const WindowPhotons& at, std::size_t count) {
  used_.assign(at.photons.size(), false);
  for (const std::uint16_t slot : at.alive.first(count)) used_[slot] = true;
  next_free_.assign(at.run_ends.size(), 0);
  for (std::size_t r = 1; r < at.run_ends.size(); ++r) next_free_[r] = at.run_ends[r - 1];
}

// Divides a photon into `wanted` equal ones, or as many as there are free slots in its run, and
// appends the copies behind `end`. Returns the new end.
std::size_t WeightWindow::split(const WindowPhotons& at, std::size_t index, std::uint32_t wanted,
                                const RandomBits& bits, std::size_t end) {
  KernelPhoton& photon = at.photons[at.alive[index]];
  const std::size_t first_copy = end;
  std::uint32_t& slot = next_free_[photon.run];
  for (std::uint32_t copy = 1; copy < wanted; ++copy) {
    while (slot < at.run_ends[photon.run] && used_[slot]) ++slot;
    if (slot == at.run_ends[photon.run]) break;
    used_[slot] = true;
    KernelPhoton& made = at.photons[slot] = photon;
    made.is_copy = true;
    made.deposit_times = 0;
    made.key ^= (std::uint64_t{bits[1]} << 32 | bits[2]) + copy * 0x9e3779b97f4a7c15u;
    at.alive[end] = static_cast<std::uint16_t>(slot);
    at.rays[end++] = at.rays[index];
  }
  const auto parts = static_cast<float>(end - first_copy + 1);
  for (float& band : photon.power) band /= parts;
  photon.deposit_times *= parts;
  for (std::size_t c = first_copy; c < end; ++c) at.photons[at.alive[c]].power = photon.power;
  return end;
}

std::size_t WeightWindow::apply(std::uint32_t bounce, const WindowPhotons& at, std::size_t count) {
  if (!decay_.is_known()) return count;
  begin_bounce(at, count);
  std::size_t kept = 0, end = count;
  // Copies are appended behind the survivors, and move down when those that end have left.
  for (std::size_t i = 0; i < count; ++i) {
    KernelPhoton& photon = at.photons[at.alive[i]];
    const std::uint32_t run_begin = photon.run > 0 ? at.run_ends[photon.run - 1] : 0;
    const bool is_small = at.run_ends[photon.run] - run_begin < kLeastRun;
    const float importance = is_small ? 1 : this->importance(photon, at.emitted[photon.run]);
    if (importance < kEndBelow || importance > kSplitAbove) {
      const RandomBits bits =
          philox(photon.key, {static_cast<std::uint32_t>(photon.number),
                              static_cast<std::uint32_t>(photon.number >> 32), bounce,
                              static_cast<std::uint32_t>(Use::kWeightWindow)});
      if (importance > kSplitAbove) {
        end = split(at, i, std::min(static_cast<std::uint32_t>(importance + 0.5f), kMostCopies),
                    bits, end);
      } else {
        if (unit(bits[0]) >= static_cast<double>(importance)) continue;
        for (float& band : photon.power) band /= importance;
      }
    }
    at.alive[kept] = at.alive[i];
    at.rays[kept++] = at.rays[i];
  }
  std::ranges::copy(at.alive.subspan(count, end - count), at.alive.subspan(kept).begin());
  std::ranges::copy(at.rays.subspan(count, end - count), at.rays.subspan(kept).begin());
  return kept + (end - count);
}

}  // namespace clamor
