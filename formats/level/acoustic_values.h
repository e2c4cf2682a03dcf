// acoustic_values.h: parses acoustic values of levels and sidecars and resamples them to eight
// bands.
//
// The length of a list implies its frequencies: 1 value is for all bands; 3 are Steam Audio's (400,
// 2500 and 15000 Hz); 6 are octaves from 125 to 4000 Hz, 7 from 125 to 8000 Hz, 8 from 63 to 8000
// Hz, 9 from 31.5 to 8000 Hz (Resonance Audio's) and 10 from 31.5 to 16000 Hz. Other lengths need
// bandsHz. Values are interpolated linearly in frequency and constant beyond the ends.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>

#include "common/air.h"
#include "common/bands.h"
#include "common/material.h"
#include "common/result.h"
#include "formats/files/json.h"
#include "formats/level/material_presets.h"

namespace clamor {

// Every value must lie between `low` and `high`. An empty `hz` implies the frequencies.
Result<Bands> bands_from_values(std::span<const double> values, std::span<const double> hz,
                                double low, double high);

// In each octave whose centre is in `hz`, the mean of the values within it, such as those of its
// thirds.
std::array<std::optional<double>, kBandCount> octave_means(std::span<const double> hz,
                                                           std::span<const double> values);

// Reads the member `key` of `fields`, at the frequencies of its member "bandsHz" if that exists and
// has the same length. Reports errors to fields.fail().
std::optional<Bands> bands_member(JsonFields& fields, std::string_view key, double low,
                                  double high);

// The times that a decay over 60 dB may have.
inline constexpr double kShortestDecay_s = 0.001, kLongestDecay_s = 100;

// Reads the member `key` of `fields`, a list of values from `low` to `high` at the frequencies of
// its member "bandsHz", or in the octaves from 63 to 8000 Hz: their octave_means(). Reports errors
// to fields.fail().
std::optional<std::array<std::optional<double>, kBandCount>> octaves_member(JsonFields& fields,
                                                                            std::string_view key,
                                                                            double low,
                                                                            double high);

// Reads { "temperature_c": 20, "humidity_percent": 50, "pressure_kpa": 101.325 }, each of which may
// be missing and is then that of `air`. `where` precedes errors.
Result<Air> read_air(const Json& json, const std::string& where, Air air = {});

struct AcousticMaterial {
  Material material;
  std::string preset;  // preset that it is based on, or empty
};

// Reads { "preset": name, "absorption": [...], "scattering": [...], "phong": [...], "transmission":
// [...], "rows_m": depth, "bandsHz": [...] }, in which preset or absorption is required, or just
// the name of a preset. Explicit values override those of the preset. A phong exponent without
// scattering means no scattering (and an exponent of 0 Lambert's law). `prefix` precedes every key
// ("acoustic_" in flat extras); members without it are then ignored. `name` is the name of the
// material.
Result<AcousticMaterial> read_acoustic_material(const Json& json, const std::string& name,
                                                const MaterialPresets& presets,
                                                const std::string& prefix = "");

}  // namespace clamor
