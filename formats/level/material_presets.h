// material_presets.h: the built-in acoustic materials (assets/materials.json).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/material.h"
#include "common/result.h"

namespace clamor {

class MaterialPresets {
 public:
  // The presets compiled into the program.
  static const MaterialPresets& built_in();

  // Parses { "bands_hz": [8], "materials": { NAME: { "absorption": [8], "scattering": [8], "phong":
  // p or [8] (optional), "sound_reduction_db": R or [8] (optional), "aliases": ["word", "two words",
  // "tile*", "~thing"] } } }. Transmission is 10^(-R/10), at most the absorption.
  static Result<MaterialPresets> parse(std::string_view json);

  // Finds a preset by its name. The Error suggests the preset with that alias ("velvet": curtain)
  // or else the one with the most similar name.
  Result<Material> get(std::string_view name) const;

  // The preset that has an alias among the words of a material's name, as "brick" in "WallBrick_02"
  // or (plural) in "bricks". Among several, substances precede things, which are marked with ~
  // ("glass" before "~table"), then aliases with more words ("wood floor" before "wood"), then the
  // match that ends last.
  std::optional<std::string> guess(std::string_view material_name) const;

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
  struct Alias {
    std::vector<std::string> words;  // globs
    std::size_t preset;
    bool substance;
  };
  std::vector<std::string> names_;
  std::vector<Material> materials_;
  std::vector<Origin> origins_;
  std::vector<Alias> aliases_;
};

}  // namespace clamor
