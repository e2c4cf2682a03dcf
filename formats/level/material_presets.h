// material_presets.h: the built-in acoustic materials (assets/materials.json), and the names by
// which they are known (assets/material_names.txt).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/material.h"
#include "common/result.h"
#include "formats/level/material_aliases.h"

namespace clamor {

// Guess of a preset from a material's name.
struct NameGuess {
  std::string preset;  // empty if it tells nothing
  std::string doubt;   // a preset of the opposite kind that it tells as well, or empty

  bool is_sure() const { return !preset.empty() && doubt.empty(); }
};

class MaterialPresets {
 public:
  // The presets compiled into the program.
  static const MaterialPresets& built_in();

  // Parses { "bands_hz": [8], "materials": { NAME: { "absorption": [8], "scattering": [8], "phong":
  // p or [8], "rows_m": depth, "sound_reduction_db": R or [8] } } }, of which the last three are
  // optional. Transmission is 10^(-R/10), at most the absorption.
  //
  // `names` has a line with the name of a preset, or with "-" for names of no material, followed
  // by indented lines "LANGUAGE: alias, alias", and comments that begin with #. It must outlive
  // what is returned.
  static Result<MaterialPresets> parse(std::string_view json, std::string_view names = {});

  // Finds a preset by its name. The Error suggests the preset with that alias ("velvet": curtain)
  // or else the one with the most similar name.
  Result<Material> get(std::string_view name) const;

  // The preset that a material's name tells (material_aliases.h).
  NameGuess guess(std::string_view material_name) const;

  const std::vector<std::string>& names() const { return names_; }

  // Source of the values of a preset.
  struct Origin {
    std::string source{};
    double low_hz = 0, high_hz = 0;  // range of measured absorption; beyond, it is extrapolated
    std::optional<Bands> reduction_db{};  // sound reduction index, by which it transmits
    std::string reduction_source{};
  };
  const Origin& origin(std::size_t index) const { return origins_[index]; }

 private:
  Result<void> add_aliases(std::string_view names);

  std::vector<std::string> names_;
  std::vector<Material> materials_;
  std::vector<Origin> origins_;
  std::vector<bool> absorbs_;  // kinds, for doubts
  MaterialAliases aliases_;
};

}  // namespace clamor
