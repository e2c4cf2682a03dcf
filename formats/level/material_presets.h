// material_presets.h: the acoustic materials that come with Clamor, assets/materials.json.
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
  // Those built into the program.
  static const MaterialPresets& built_in();

  // Any file of the same form: { "bands_hz": [8], "materials": { NAME: { "absorption": [8],
  // "scattering": [8], "phong": p or [8] (optional), "aliases": ["word", "two words", "tile*",
  // "~thing"] } }
  static Result<MaterialPresets> parse(std::string_view json);

  // By its own name. The Error names the preset that the name means by an alias ("velvet":
  // curtain), or else the one that is spelled most like it.
  Result<Material> get(std::string_view name) const;

  // The preset of which an alias occurs among the words of a material's name, as "brick" in
  // "WallBrick_02" or, in the plural, in "bricks". Substances win over things, which are marked
  // with ~ ("glass" over "~table"); then the alias of most words ("wood floor" over "wood"); then
  // the one that ends last.
  std::optional<std::string> guess(std::string_view material_name) const;

  const std::vector<std::string>& names() const { return names_; }

  // Where the figures of preset `index` of names() come from.
  struct Origin {
    std::string source;
    double low_hz = 0, high_hz = 0;  // range of the measured absorption; extrapolated outside of it
  };
  const Origin& origin(std::size_t index) const { return origins_[index]; }

 private:
  struct Alias {
    std::vector<std::string> words;  // each a glob
    std::size_t preset;
    bool substance;
  };
  std::vector<std::string> names_;
  std::vector<Material> materials_;
  std::vector<Origin> origins_;
  std::vector<Alias> aliases_;
};

}  // namespace clamor
