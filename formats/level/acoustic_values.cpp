#include "formats/level/acoustic_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr double kMaxExponent = 1000;
constexpr std::size_t kMaxPoints = 1000;

// The frequencies implied by a list of `count` values; empty if there is no convention.
std::span<const double> frequencies_hz(std::size_t count) {
  static constexpr std::array<double, 3> kSteamAudio_hz = {400, 2500, 15000};
  static constexpr std::array<double, 10> kOctaves_hz = {31.5, 63,   125,  250,  500,
                                                         1000, 2000, 4000, 8000, 16000};
  const std::span<const double> octaves(kOctaves_hz);
  switch (count) {
    case 3:
      return kSteamAudio_hz;
    case 6:
      return octaves.subspan(2, 6);
    case 7:
      return octaves.subspan(2, 7);
    case 8:
      return octaves.subspan(1, 8);
    case 9:
      return octaves.subspan(0, 9);
    case 10:
      return octaves;
    default:
      return {};
  }
}

// Reads the member `key`, frequencies that increase.
std::optional<std::vector<double>> frequencies_member(JsonFields& fields, const std::string& key) {
  auto hz = fields.numbers(key);
  if (hz && (std::ranges::adjacent_find(*hz, std::greater_equal<>()) != hz->end() ||
             hz->front() <= 0 || hz->back() > 1e6)) {
    fields.fail("'bandsHz' must be frequencies above 0, each greater than the one before");
    return std::nullopt;
  }
  return hz;
}

}  // namespace

Result<Bands> bands_from_values(std::span<const double> values, std::span<const double> hz,
                                double low, double high) {
  for (const double value : values)
    if (!(value >= low && value <= high))
      return Error(fmt::format("is {:g} but must be from {:g} to {:g}", value, low, high));
  if (values.size() == 1) return same_in_all_bands(static_cast<float>(values[0]));
  if (hz.size() != values.size()) hz = frequencies_hz(values.size());
  if (hz.empty() || values.size() > kMaxPoints)
    return Error(
        fmt::format("has {} values; give 1, 3, 6, 7, 8, 9 or 10, or as many frequencies "
                    "in 'bandsHz'",
                    values.size()));
  return bands_from_points(hz, values);
}

std::array<std::optional<double>, kBandCount> octave_means(std::span<const double> hz,
                                                           std::span<const double> values) {
  std::array<std::optional<double>, kBandCount> octaves;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double sum = 0;
    int count = 0;
    bool has_centre = false;
    for (std::size_t i = 0; i < hz.size(); ++i) {
      const double ratio = hz[i] / kBandCentres_hz[b];
      if (ratio < 1 / std::numbers::sqrt2 || ratio >= std::numbers::sqrt2) continue;
      sum += values[i];
      ++count;
      has_centre = has_centre || std::abs(ratio - 1) < 0.05;
    }
    if (has_centre) octaves[b] = sum / count;
  }
  return octaves;
}

std::optional<Bands> bands_member(JsonFields& fields, std::string_view key, double low,
                                  double high) {
  // In flat extras the prefix precedes bandsHz as well.
  const auto under = key.rfind('_');
  const std::string prefix(under == std::string_view::npos ? "" : key.substr(0, under + 1));
  const auto values = fields.numbers(key);
  const auto hz = frequencies_member(fields, prefix + "bandsHz");
  if (!values) return std::nullopt;
  const auto bands = bands_from_values(
      *values, hz ? std::span<const double>(*hz) : std::span<const double>(), low, high);
  if (!bands.ok()) {
    fields.fail(in_quotes(key) + " " + bands.error().message);
    return std::nullopt;
  }
  return *bands;
}

std::optional<std::array<std::optional<double>, kBandCount>> octaves_member(JsonFields& fields,
                                                                            std::string_view key,
                                                                            double low,
                                                                            double high) {
  const auto hz = frequencies_member(fields, "bandsHz")
                      .value_or(std::vector(kBandCentres_hz.begin(), kBandCentres_hz.end()));
  const auto values = fields.numbers(key);
  if (!values) return std::nullopt;
  if (values->size() != hz.size())
    fields.fail(in_quotes(key) + " must have a value for each of 'bandsHz'");
  else if (std::ranges::any_of(*values, [&](double x) { return !(x >= low && x <= high); }))
    fields.fail(fmt::format("{} must have values from {:g} to {:g}", in_quotes(key), low, high));
  else
    return octave_means(hz, *values);
  return std::nullopt;
}

Result<Air> read_air(const Json& json, const std::string& where, Air air) {
  JsonFields fields(json, where);
  // Slightly more than the range for which ISO 9613-1 states its accuracy.
  air.temperature_c = fields.number("temperature_c", -60, 80).value_or(air.temperature_c);
  air.humidity_percent = fields.number("humidity_percent", 0, 100).value_or(air.humidity_percent);
  air.pressure_kpa = fields.number("pressure_kpa", 10, 200).value_or(air.pressure_kpa);
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();
  return air;
}

Result<AcousticMaterial> read_acoustic_material(const Json& json, const std::string& name,
                                                const MaterialPresets& presets,
                                                const std::string& prefix) {
  AcousticMaterial result;
  result.material.name = name;
  JsonFields fields(json, "acoustics of material " + in_quotes(name));

  const auto preset = json.string() != nullptr ? *json.string() : fields.string(prefix + "preset");
  if (preset) {
    const auto found = presets.get(*preset);
    if (!found.ok()) return found.error().in("material " + in_quotes(name));
    result.material = *found;
    result.material.name = name;
    result.preset = *preset;
    if (json.string() != nullptr) return result;
  }

  const auto absorption = bands_member(fields, prefix + "absorption", 0, 1);
  const auto scattering = bands_member(fields, prefix + "scattering", 0, 1);
  const auto phong = bands_member(fields, prefix + "phong", 0, 1e9);
  const auto transmission = bands_member(fields, prefix + "transmission", 0, 1);
  const auto rows_m = fields.number(prefix + "rows_m", 0, kDeepestRows_m);
  for (const char* note : {"name", "comment", "source", "extras", "extensions"}) fields.any(note);
  const auto ok = prefix.empty() ? fields.result_without_unknown() : fields.result();
  if (!ok.ok()) return ok.error();
  if (!preset && !absorption)
    return Error(fields.where() + ": give 'preset' or 'absorption', as in \"preset\": \"brick\".");

  if (absorption) result.material.absorption = *absorption;
  if (scattering) result.material.scattering = *scattering;
  if (phong) {
    result.material.phong = *phong;
    for (float& exponent : result.material.phong) exponent = std::min(exponent, kMirrorExponent);
    if (!scattering && !preset) result.material.scattering = Bands{};
  }
  if (transmission) result.material.transmission = *transmission;
  if (rows_m) result.material.rows_m = static_cast<float>(*rows_m);
  return result;
}

}  // namespace clamor
