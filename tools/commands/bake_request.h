// bake_request.h: the options that determine the result of a bake; shared by clamor bake and clamor
// merge.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "formats/gltf/level_import.h"
#include "tools/program/arguments.h"

namespace clamor {

// Options that determine the result.
struct BakeRequest {
  std::string level_path;
  ImportOptions import;
  std::optional<std::string> seed, photons, sources;
  std::string instances = "on";
  double simplify_m = 0;
  double kappa = BakeSettings{}.roulette_exponent, longest_s = BakeSettings{}.longest_path_s;

  void add_options(Arguments& parser);

  // The problem with the values, if there is one.
  std::optional<std::string> complaint() const;

  // The options as they would be typed, without those that have their defaults.
  std::vector<std::string> words() const;

  // Level path and words in one string, which a shard stores so that it can be merged; and back.
  std::string note() const;
  static std::optional<BakeRequest> from_note(const std::string& note);
};

// A whole number of at most 18 digits, or nothing.
std::optional<std::uint64_t> whole_number(const std::string& text);

}  // namespace clamor
