// bake_request.h: what is to be baked: a level, and the options that determine the result.
//
// Numbers are text as it was typed, because the bake file keeps the words of the command that makes
// it again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bake/probes/probe_placement.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/gltf/import_options.h"

namespace clamor {

struct BakeRequest {
  std::string level_path;
  ImportOptions import;
  std::optional<std::string> seed, photons, sources;
  std::string probes = "none";  // or "auto", or metres between them
  std::optional<std::string> probe_sources;
  std::string instances = "on";
  std::string early_order = "auto";  // or 0 to kMaxImageOrder
  double simplify_m = 0;
  double roulette_exponent = kRouletteExponent;
  std::optional<double> longest_s;  // see BakeSettings; the plan chooses it if there is none

  // The problem with the values, if there is one.
  std::optional<std::string> complaint() const;

  // The options as they would be typed, without those that have their defaults.
  std::vector<std::string> words() const;
};

// The placement that --probes asks for, or nothing.
std::optional<ProbeOptions> probe_options(const std::string& text);

// A whole number of at most 18 digits, or nothing.
std::optional<std::uint64_t> whole_number(const std::string& text);

}  // namespace clamor
