#include "tools/report/room_summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include <fmt/format.h>

#include "bake/mesh/mesh_preparation.h"
#include "common/air.h"
#include "common/text.h"
#include "tools/report/bake_overview.h"
#include "tools/report/room_response.h"

namespace clamor {

namespace {

constexpr std::size_t k125Hz = 1, k250Hz = 2, k500Hz = 3, k1000Hz = 4;
constexpr double kBooms = 1.45, kThin = 0.8;  // ratios of the bass
constexpr double kRings_s = 2.2;

// Mean of some octaves over all listeners that have a value.
std::optional<double> mean_of(std::span<const RoomResponse> responses,
                              RoomParameters::Value RoomParameters::*value,
                              std::span<const std::size_t> bands) {
  double sum = 0;
  int count = 0;
  for (const RoomResponse& response : responses)
    for (const std::size_t band : bands)
      if (const auto& one = (response.parameters.*value)[band]) sum += *one, ++count;
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

constexpr std::array kMiddle = {k500Hz, k1000Hz}, kBass = {k125Hz, k250Hz};

// Typical reverberation times of occupied rooms.
std::string room_like(double t30_s) {
  if (t30_s < 0.35) return "like a studio";
  if (t30_s < 0.65) return "like a furnished living room";
  if (t30_s < 0.9) return "like a classroom";
  if (t30_s < 1.4) return "like a theatre";
  if (t30_s < 1.8) return "like a chamber music hall";
  if (t30_s < 2.4) return "like a concert hall";
  if (t30_s < 4) return "like a church";
  return "like a cathedral";
}

}  // namespace

std::optional<double> middle_value(std::span<const RoomResponse> responses,
                                   const ParameterKind& kind) {
  return mean_of(responses, kind.value, kMiddle);
}

std::optional<double> bass_ratio(std::span<const RoomResponse> responses) {
  const auto bass_s = mean_of(responses, &RoomParameters::t30_s, kBass);
  const auto middle_s = mean_of(responses, &RoomParameters::t30_s, kMiddle);
  if (!bass_s || !middle_s || !(*middle_s > 0)) return std::nullopt;
  return *bass_s / *middle_s;
}

std::vector<double> areas_m2(const Mesh& mesh, std::size_t materials) {
  std::vector<double> areas(materials, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    areas[mesh.materials[t]] += area_m2(mesh, t);
  return areas;
}

std::vector<MetMaterial> met_materials(const BakeFile& file) {
  const std::vector<Material>& materials = file.materials();
  const std::vector<Bands>& arrived = file.statistics().power_arrived;
  std::vector<MetMaterial> met;
  for (const MaterialGroup& group : groups_of(std::span(materials))) {
    MetMaterial sum;
    sum.absorption = materials[group.first].absorption;
    sum.transmission = materials[group.first].transmission;
    float most = 0;
    std::size_t count = 0;
    for (std::size_t m = group.first; m < arrived.size(); ++m) {
      if (materials[m].absorption != sum.absorption || sum_of(arrived[m]) == 0 ||
          std::ranges::find(group.names, materials[m].name) == group.names.end())
        continue;
      ++count;
      for (std::size_t b = 0; b < kBandCount; ++b) sum.arrived[b] += arrived[m][b];
      if (sum_of(arrived[m]) > most) most = sum_of(arrived[m]), sum.name = materials[m].name;
    }
    if (count > 1) sum.name += fmt::format(" and {} more", count - 1);
    if (count > 0) met.push_back(std::move(sum));
  }
  const auto all = [](const MetMaterial& material) {
    double sum = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) sum += material.dissipated(b);
    return sum;
  };
  std::ranges::stable_sort(met, std::greater(), all);
  return met;
}

std::vector<DecidingMaterial> deciding_materials(const BakeFile& file) {
  const BakeStatistics& statistics = file.statistics();
  std::vector<DecidingMaterial> deciding;
  if (!(statistics.mean_free_path_m > 0)) return deciding;
  const double per_s = speed_of_sound_mps(file.settings().air) / statistics.mean_free_path_m;
  const std::vector<MetMaterial> met = met_materials(file);
  std::array<double, kBandCount> reflected{};  // power
  for (const MetMaterial& material : met)
    for (std::size_t b = 0; b < kBandCount; ++b)
      reflected[b] += static_cast<double>(material.arrived[b]) *
                      (1 - static_cast<double>(material.absorption[b]));
  for (const MetMaterial& material : met) {
    DecidingMaterial one{material.name};
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double t_s = statistics.decay.t30_s[b];
      if (reflected[b] > 0)
        one.slope_s[b] =
            static_cast<float>(-t_s * t_s / (6 * std::numbers::ln10) * per_s *
                               static_cast<double>(material.arrived[b]) / reflected[b]);
    }
    if (sum_of(one.slope_s) < 0) deciding.push_back(std::move(one));
  }
  std::ranges::stable_sort(deciding, std::less(),
                           [](const DecidingMaterial& one) { return sum_of(one.slope_s); });
  return deciding;
}

std::string described(std::span<const RoomResponse> responses, Enclosure enclosure, bool is_crowd) {
  const auto t30_s = mean_of(responses, &RoomParameters::t30_s, kMiddle);
  if (is_crowd && t30_s)
    return fmt::format("What its emitters sound all at once decays in {:.1f} s.", *t30_s);
  const auto c80_db = mean_of(responses, &RoomParameters::c80_db, kMiddle);
  const auto d50 = mean_of(responses, &RoomParameters::d50, kMiddle);
  std::string text;
  if (enclosure == Enclosure::kMostlyOpen)
    text = "More than half of the sound leaves it" +
           (t30_s ? fmt::format("; what its surfaces reflect decays in {:.1f} s.", *t30_s)
                  : std::string(", and it reflects too little for a decay time."));
  else if (t30_s)
    text = fmt::format("It reverberates for {:.{}f} s, {}.", *t30_s, *t30_s < 10 ? 1 : 0,
                       room_like(*t30_s));
  else
    text = "It is too dry, or too open, for a reverberation time.";
  if (d50)
    text += fmt::format(" Speech is {}", *d50 > 0.7   ? "clear"
                                         : *d50 > 0.5 ? "clear enough"
                                         : *d50 > 0.3 ? "blurred"
                                                      : "hard to follow");
  if (d50 && c80_db)
    text += fmt::format(", and music {}", *c80_db > 8    ? "sounds dry"
                                          : *c80_db > 3  ? "is transparent"
                                          : *c80_db > -3 ? "has a balance of clarity and blend"
                                                         : "blurs");
  if (d50) text += ".";
  if (const auto ratio = bass_ratio(responses)) {
    if (*ratio > kBooms)
      text += fmt::format(" It booms: the bass decays {:.1f} times as long as the middle.", *ratio);
    else if (*ratio < kThin)
      text += fmt::format(" It sounds thin: the bass decays {:.1f} times as long as the middle.",
                          *ratio);
  }
  return text;
}

std::string cause_of_decay(std::span<const RoomResponse> responses,
                           std::span<const MetMaterial> materials) {
  return cause_of_decay(bass_ratio(responses), mean_of(responses, &RoomParameters::t30_s, kMiddle),
                        materials);
}

std::string cause_of_decay(const DecaySummary& decay, std::span<const MetMaterial> materials) {
  const auto mean = [&](std::span<const std::size_t> bands) -> std::optional<double> {
    const double a = decay.t30_s[bands[0]], b = decay.t30_s[bands[1]];
    return a > 0 && b > 0 ? std::optional((a + b) / 2) : std::nullopt;
  };
  const auto bass_s = mean(kBass), middle_s = mean(kMiddle);
  return cause_of_decay(bass_s && middle_s ? std::optional(*bass_s / *middle_s) : std::nullopt,
                        middle_s, materials);
}

std::string cause_of_decay(std::optional<double> ratio, std::optional<double> t30_s,
                           std::span<const MetMaterial> materials) {
  const bool booms = ratio && *ratio > kBooms;
  if (materials.empty() || !(booms || (t30_s && *t30_s > kRings_s))) return "";
  const std::span<const std::size_t> judged = booms ? kBass : kMiddle;
  const char* const octaves = booms ? "125 and 250 Hz" : "500 Hz and 1 kHz";
  const auto arrived = [](const MetMaterial& at, std::span<const std::size_t> bands) {
    return static_cast<double>(at.arrived[bands[0]] + at.arrived[bands[1]]);
  };
  const auto absorbed = [](const MetMaterial& at, std::span<const std::size_t> bands) {
    return static_cast<double>(at.arrived[bands[0]] * at.absorption[bands[0]] +
                               at.arrived[bands[1]] * at.absorption[bands[1]]);
  };
  double all = 0, taken = 0, all_middle = 0, taken_middle = 0;
  const MetMaterial* worst = nullptr;  // that reflects most
  const auto reflected = [&](const MetMaterial& at) {
    return arrived(at, judged) - absorbed(at, judged);
  };
  for (const MetMaterial& at : materials) {
    all += arrived(at, judged), taken += absorbed(at, judged);
    all_middle += arrived(at, kMiddle), taken_middle += absorbed(at, kMiddle);
    if (worst == nullptr || reflected(at) > reflected(*worst)) worst = &at;
  }
  if (!(all > 0 && all_middle > 0)) return "";
  std::string text = fmt::format("Its surfaces absorb {:.0f} % of the sound that meets them at {}",
                                 100 * taken / all, octaves);
  if (booms)
    text += fmt::format(", but {:.0f} % at 500 Hz and 1 kHz", 100 * taken_middle / all_middle);
  const double of_worst = arrived(*worst, judged);
  return text + fmt::format(
                    ". {} reflects most: {:.0f} % of the sound meets it, and it absorbs {:.0f} % "
                    "of that. Give it, or another surface that much sound meets, a material that "
                    "absorbs more there (clamor materials lists them).",
                    in_quotes(worst->name), 100 * of_worst / all,
                    of_worst > 0 ? 100 * absorbed(*worst, judged) / of_worst : 0.0);
}

}  // namespace clamor
