#include "bake/absorption_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "bake/bake_options.h"
#include "bake/received_paths.h"
#include "bake/report/decay_estimate.h"
#include "bake/traced_state.h"
#include "common/maths.h"
#include "common/thread_team.h"
#include "common/utf8_path.h"
#include "formats/files/atomic_file.h"
#include "formats/files/json.h"
#include "formats/level/acoustic_values.h"
#include "formats/level/level.h"
#include "formats/level/material_presets.h"

namespace clamor {

namespace {

constexpr int kRounds = 6, kMaxTraces = 3;
constexpr double kGoodEnough = 1e-3, kTolerance = 0.01;  // relative differences of times
constexpr double kFarOff = 10;                           // a time that there is none of, in octaves
constexpr double kMinEffective = 64;                     // as PathCache::kMinDeposits

// One octave.
class OctaveFit {
 public:
  OctaveFit(const FittedMaterials& fitted, std::size_t band, double measured_s, double to_db)
      : band_(band), measured_s_(measured_s), to_db_(to_db) {
    for (const FittedMaterial& material : fitted.list) {
      ranges_.push_back(AbsorptionRange::of(static_cast<double>(material.absorption[band])));
      shares_.push_back(material.area_m2 / fitted.total_area_m2);
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

  // By how many factors of two the time is too long with all that the bounds allow, or 0.
  double lack() const {
    const double factors = now_.time_s ? log2_of(*now_.time_s / measured_s_) : 0;
    return factors > kTolerance ? factors : 0;
  }
  // The time with what is known of all materials but one.
  std::optional<double> time_with(const ReceivedPaths& paths, std::size_t one,
                                  double absorption) const {
    std::vector<double> absorptions;
    for (const AbsorptionRange& range : ranges_) absorptions.push_back(range.known);
    absorptions[one] = std::min(absorption, kMostAbsorption);
    return paths.decay(band_, absorptions, to_db_).time_s;
  }
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

// Where no absorption within its bounds is enough, people and seats that the level does not tell of
// may absorb the rest: names the surface that as a seating area would come nearest to the measured
// times, if it comes nearer by half. Otherwise "".
std::string seating_hint(const ReceivedPaths& paths, const FittedMaterials& fitted,
                         const std::array<std::optional<OctaveFit>, kBandCount>& octaves) {
  std::string hint;
  double least = 0;
  for (const auto& octave : octaves) least += octave ? octave->lack() / 2 : 0;
  for (const char* preset : {"audience", "seats_upholstered", "seats_wood"}) {
    const auto seating = MaterialPresets::built_in().get(preset);
    for (std::size_t u = 0; u < fitted.list.size() && seating.ok(); ++u) {
      double off = 0;
      std::string times;
      for (std::size_t b = 0; b < kBandCount; ++b) {
        if (!octaves[b] || !(octaves[b]->lack() > 0)) continue;
        const auto time_s =
            octaves[b]->time_with(paths, u, static_cast<double>(seating->absorption[b]));
        off += time_s ? std::abs(log2_of(octaves[b]->octave().measured_s / *time_s)) : kFarOff;
        times += fmt::format("{}{:.2f} s at {} Hz", times.empty() ? "" : ", ", time_s.value_or(0),
                             kBandCentres_hz[b]);
      }
      if (!(off < least)) continue;
      least = off;
      hint = fmt::format(". If {} ({:.0f} m2) were a seating area, the preset '{}' would give {}",
                         in_quotes(fitted.list[u].name), fitted.list[u].area_m2, preset, times);
    }
  }
  return hint;
}

Result<AbsorptionFit> fit_on_this_team(const Level& level, const BakeOptions& options,
                                       const MeasuredDecay& measured) {
  const FittedMaterials fitted(level.mesh, level.materials);
  if (fitted.list.empty())
    return Error(
        "no material's absorption can be fitted: thin ones, open ones and different ones of one "
        "name stay as they are");
  std::array<std::optional<OctaveFit>, kBandCount> octaves;
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (measured.times_s[b]) octaves[b].emplace(fitted, b, *measured.times_s[b], measured.to_db);
  BakeSettings settings = options.settings;
  settings.early_order = 0;  // all reflections leave deposits
  Level traced = level;
  AbsorptionFit fit;
  std::optional<ReceivedPaths> paths;
  for (bool carries = false; !carries && fit.traces < kMaxTraces; ++fit.traces) {
    const TracedState state(traced, settings);
    const std::size_t receivers = decay_receivers(state.scene, traced.emitters).size();
    if (receivers == 0)
      return Error("no surface is near the emitters, so that there is no decay to fit");
    paths.emplace(state, receivers, traced.materials, fitted, options);
    if (options.is_stopped()) return Error("stopped");
    team_for(0, kBandCount, [&](std::size_t b) {
      if (octaves[b]) octaves[b]->run(*paths);
    });
    carries = true;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      if (!octaves[b]) continue;
      carries = carries && octaves[b]->decay().effective >= kMinEffective;
      const std::vector<double> found = octaves[b]->absorptions();
      for (std::size_t m = 0; m < traced.materials.size(); ++m)
        if (const std::uint16_t index = fitted.of_level[m]; index != FittedMaterials::kFixed)
          traced.materials[m].absorption[b] = static_cast<float>(found[index]);
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
                 "materials other presets" +
                 seating_hint(*paths, fitted, octaves));
  for (std::size_t u = 0; u < fitted.list.size(); ++u) {
    const FittedMaterial& material = fitted.list[u];
    AbsorptionFit::Surface surface{material.name, material.area_m2, material.absorption,
                                   material.absorption};
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
  const auto t30_s = octaves_member(fields, "t30_s", kShortestDecay_s, kLongestDecay_s),
             t20_s = octaves_member(fields, "t20_s", kShortestDecay_s, kLongestDecay_s);
  if (!t30_s && !t20_s) fields.fail("needs 't30_s' or 't20_s', the measured reverberation times");
  MeasuredDecay measured;
  measured.to_db = t30_s ? -35 : -25;
  measured.times_s = t30_s.value_or(t20_s.value_or(measured.times_s));
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
    const auto of_level = std::ranges::find(level.materials, surface.name, &Material::name);
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
    if (of_level->rows_m > 0)
      values.emplace_back("rows_m", std::round(1e6 * static_cast<double>(of_level->rows_m)) / 1e6);
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
