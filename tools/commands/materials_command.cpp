// materials_command.cpp: clamor materials: lists the presets, or the preset of a material name.
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "formats/level/material_presets.h"
#include "tools/analysis/json_values.h"
#include "tools/commands/commands.h"
#include "tools/program/arguments.h"

namespace clamor {

namespace {

// Prints a name and one value per band.
void print_bands(std::ostream& out, const std::string& name, const Bands& bands) {
  fmt::print(out, "{:<18}", name);
  for (const float value : bands) fmt::print(out, " {:>6.3g}", value);
}

void print_table(std::ostream& out, const MaterialPresets& presets) {
  fmt::print(out, "{:<18}", "absorption at Hz");
  for (const double hz : kBandCentres_hz) fmt::print(out, " {:>6.0f}", hz);
  fmt::print(out, "  measured, from\n");
  for (std::size_t i = 0; i < presets.names().size(); ++i) {
    const auto& origin = presets.origin(i);
    print_bands(out, presets.names()[i], presets.get(presets.names()[i])->absorption);
    if (origin.high_hz > 0)
      fmt::print(out, "  {:.0f} to {:.0f} Hz: {}\n", origin.low_hz, origin.high_hz, origin.source);
    else
      fmt::print(out, "  {}\n", origin.source);
  }
  fmt::print(out, "\n{:<18}\n", "scattering");
  for (const std::string& name : presets.names()) {
    print_bands(out, name, presets.get(name)->scattering);
    fmt::print(out, "\n");
  }
  fmt::print(out, "\n{:<18}\n", "transmission, as the sound reduction index in dB");
  for (std::size_t i = 0; i < presets.names().size(); ++i) {
    const auto& origin = presets.origin(i);
    if (!origin.reduction_db) {
      fmt::print(out, "{:<18} none\n", presets.names()[i]);
      continue;
    }
    print_bands(out, presets.names()[i], *origin.reduction_db);
    fmt::print(out, "  {}\n", origin.reduction_source);
  }
}

OrderedJson json_of(const MaterialPresets& presets) {
  auto list = OrderedJson::array();
  for (std::size_t i = 0; i < presets.names().size(); ++i) {
    const Material material = *presets.get(presets.names()[i]);
    const auto& origin = presets.origin(i);
    list.push_back({{"name", presets.names()[i]},
                    {"bands_hz", kBandCentres_hz},
                    {"absorption", material.absorption},
                    {"scattering", material.scattering},
                    {"transmission", material.transmission},
                    {"measured_hz", {origin.low_hz, origin.high_hz}},
                    {"source", origin.source},
                    {"transmission_source", origin.reduction_source}});
    if (material.rows_m > 0) list.back()["rows_m"] = material.rows_m;
  }
  return list;
}

}  // namespace

int run_materials(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  bool json = false;
  std::vector<std::string> names;
  Arguments parser("materials",
                   "Lists the material presets: absorption, scattering and transmission per octave "
                   "band, and the "
                   "source of the figures. Bands outside the measured range are extrapolated. With "
                   "--name, prints the preset "
                   "that a material of that name gets.",
                   "clamor materials --name Brick_Wall_03 --name velvet");
  parser.flag("--json", json, "print a list of objects with all values");
  parser.option("--name", names, "name of a material in a level; may be repeated");
  if (const auto code = parser.parse(arguments, out, err)) return *code;

  const MaterialPresets& presets = MaterialPresets::built_in();
  for (const std::string& name : names) {
    const NameGuess guess = presets.guess(name);
    if (guess.preset.empty())
      fmt::print(out, "{} -> no preset; the bake takes its default, plaster\n", name);
    else if (guess.is_sure())
      fmt::print(out, "{} -> {}\n", name, guess.preset);
    else
      fmt::print(
          out, "{} -> {} or {}, which differ much; the bake warns and takes its default, plaster\n",
          name, guess.preset, guess.doubt);
  }
  if (!names.empty()) return kSuccess;
  if (json)
    out << json_of(presets).dump(2) << '\n';
  else
    print_table(out, presets);
  return kSuccess;
}

}  // namespace clamor
