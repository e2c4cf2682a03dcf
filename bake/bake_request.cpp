#include "bake/bake_request.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include "bake/bake_options.h"
#include "bake/bake_plan.h"
#include "formats/bake_file/image_source.h"
#include "formats/level/emitter_spec.h"

namespace clamor {

std::optional<std::uint64_t> whole_number(const std::string& text) {
  if (text.empty() || text.size() > 18 ||
      !std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; }))
    return std::nullopt;
  return std::stoull(text);
}

std::optional<ProbeOptions> probe_options(const std::string& text) {
  using Placement = ProbeOptions::Placement;
  ProbeOptions options;
  if (text == "auto") return options;
  if (text == "none") {
    options.placement = Placement::kNone;
    return options;
  }
  const char* const end = text.data() + text.size();
  const auto [rest, wrong] = std::from_chars(text.data(), end, options.spacing_m);
  if (wrong != std::errc() || rest != end || !(options.spacing_m > 0)) return std::nullopt;
  options.placement = Placement::kSpacing;
  return options;
}

std::optional<std::string> BakeRequest::complaint() const {
  for (const std::string& emitter : import.emitters)
    if (const auto spec = parse_emitter(emitter); !spec.ok()) return spec.error().message;
  if (photons && (!whole_number(*photons) || *whole_number(*photons) == 0 ||
                  *whole_number(*photons) > 4'000'000'000u))
    return "--photons " + in_quotes(*photons) + " is not a whole number from 1 to 4000000000";
  if (sources && (!whole_number(*sources) || *whole_number(*sources) == 0 ||
                  *whole_number(*sources) > kMaxSources))
    return "--sources " + in_quotes(*sources) + " is not a whole number from 1 to " +
           std::to_string(kMaxSources);
  if (!probe_options(probes))
    return "--probes " + in_quotes(probes) + " is neither auto nor none nor a number of metres";
  if (probe_sources && (!whole_number(*probe_sources) || *whole_number(*probe_sources) == 0 ||
                        *whole_number(*probe_sources) > kMaxProbeSources))
    return "--probe-sources " + in_quotes(*probe_sources) + " is not a whole number from 1 to " +
           std::to_string(kMaxProbeSources);
  if (seed && !whole_number(*seed))
    return "--seed " + in_quotes(*seed) + " is not a whole number from 0 to 999999999999999999";
  if (!(simplify_m >= 0 && simplify_m <= 10)) return "--simplify must lie between 0 and 10 metres";
  if (instances != "on" && instances != "off")
    return "--instances " + in_quotes(instances) + " is neither on nor off";
  if (early_order != "auto" &&
      (!whole_number(early_order) || *whole_number(early_order) > std::uint64_t{kMaxImageOrder}))
    return "--early-order " + in_quotes(early_order) + " is neither auto nor 0 to " +
           std::to_string(kMaxImageOrder);
  if (!(roulette_exponent >= 0 && roulette_exponent <= 1))
    return "--kappa must lie between 0 and 1";
  if (longest_s && !(*longest_s > 0 && *longest_s <= kLongestPath_s))
    return "--longest must lie between 0 and 60 seconds";
  return std::nullopt;
}

std::vector<std::string> BakeRequest::words() const {
  std::vector<std::string> words;
  const auto add = [&words](const std::string& option, const std::optional<std::string>& value) {
    if (value) words.insert(words.end(), {option, *value});
  };
  for (const std::string& emitter : import.emitters) add("--emitter", emitter);
  add("--acoustics", import.sidecar);
  add("--material", import.material);
  if (import.hidden_meshes) words.emplace_back("--hidden");
  for (const std::string& pattern : import.ignored) add("--ignore", pattern);
  for (const std::string& pattern : import.kept) add("--keep", pattern);
  add("--scene", import.scene);
  for (const std::string& name : import.ignored_extensions) add("--ignore-required", name);
  add("--photons", photons);
  add("--sources", sources);
  if (probes != "none") add("--probes", probes);
  add("--probe-sources", probe_sources);
  add("--seed", seed);
  if (simplify_m > 0) add("--simplify", fmt::format("{}", simplify_m));
  if (instances != "on") add("--instances", instances);
  if (early_order != "auto") add("--early-order", early_order);
  if (roulette_exponent != kRouletteExponent) add("--kappa", fmt::format("{}", roulette_exponent));
  if (longest_s) add("--longest", fmt::format("{}", *longest_s));
  return words;
}

}  // namespace clamor
