#include "tools/commands/bake_request.h"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include <fmt/format.h>

#include "formats/level/emitter_spec.h"

namespace clamor {

std::optional<std::uint64_t> whole_number(const std::string& text) {
  if (text.empty() || text.size() > 18 ||
      !std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; }))
    return std::nullopt;
  return std::stoull(text);
}

void BakeRequest::add_options(Arguments& parser) {
  parser.option(
      "--emitter", import.emitters,
      "add an emitter: name=NAME,signal=FILE|noise|impulse,at=X,Y,Z[,facing=X,Y,Z][,gain=0dB]"
      "[,directivity=P][,delay=S][,loop=yes]; may be repeated");
  parser.option("--acoustics", import.sidecar,
                "sidecar file to use instead of LEVEL.acoustics.json");
  parser.option("--material", import.material,
                "preset for materials without acoustic data [plaster]");
  parser.flag("--hidden", import.hidden_meshes, "include meshes that the level marks as hidden");
  parser.option(
      "--photons", photons,
      "photons to trace; more of them reduce noise, not the number of sources [unset: enough for "
      "--sources]");
  parser.option(
      "--sources", sources,
      "maximum number of secondary sources to keep [unset: 200 000 per room with emitters]");
  parser.option("--seed", seed,
                "seed of all random numbers; the same seed gives the same bytes [1]");
  parser.option(
      "--simplify", simplify_m,
      "remove triangles, moving surfaces by at most this many metres, as in 0.05 [0: off]");
  parser.option("--instances", instances,
                "on or off: store groups of emitters that the level repeats once, as instances");
  parser.words("--instances", {"on", "off"});
  parser.option(
      "--kappa", kappa,
      "exponent of Russian roulette, 0 to 1: a path survives with probability (power after / "
      "power before)^kappa");
  parser.option("--longest", longest_s, "longest path to trace, in seconds");
}

std::optional<std::string> BakeRequest::complaint() const {
  for (const std::string& emitter : import.emitters)
    if (const auto spec = parse_emitter(emitter); !spec.ok()) return spec.error().message;
  if (photons && (!whole_number(*photons) || *whole_number(*photons) == 0 ||
                  *whole_number(*photons) > 4'000'000'000u))
    return "--photons " + in_quotes(*photons) + " is not a whole number from 1 to 4000000000";
  if (sources && (!whole_number(*sources) || *whole_number(*sources) == 0 ||
                  *whole_number(*sources) > 10'000'000u))
    return "--sources " + in_quotes(*sources) + " is not a whole number from 1 to 10000000";
  if (seed && !whole_number(*seed)) return "--seed " + in_quotes(*seed) + " is not a whole number";
  if (!(simplify_m >= 0 && simplify_m <= 10)) return "--simplify must lie between 0 and 10 metres";
  if (instances != "on" && instances != "off")
    return "--instances " + in_quotes(instances) + " is neither on nor off";
  if (!(kappa >= 0 && kappa <= 1)) return "--kappa must lie between 0 and 1";
  if (!(longest_s > 0 && longest_s <= 60)) return "--longest must lie between 0 and 60 seconds";
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
  add("--photons", photons);
  add("--sources", sources);
  add("--seed", seed);
  if (simplify_m > 0) add("--simplify", fmt::format("{}", simplify_m));
  if (instances != "on") add("--instances", instances);
  if (kappa != BakeSettings{}.roulette_exponent) add("--kappa", fmt::format("{}", kappa));
  if (longest_s != BakeSettings{}.longest_path_s) add("--longest", fmt::format("{}", longest_s));
  return words;
}

std::string BakeRequest::note() const {
  std::string note = std::filesystem::absolute(level_path).string();
  for (const std::string& word : words()) note += '\0' + word;
  return note;
}

std::optional<BakeRequest> BakeRequest::from_note(const std::string& note) {
  std::vector<std::string> words{""};
  for (const char c : note)
    if (c == '\0')
      words.emplace_back();
    else
      words.back() += c;
  BakeRequest request;
  request.level_path = words[0];
  Arguments parser("merge", "", "");
  request.add_options(parser);
  std::ostringstream ignored;
  if (request.level_path.empty() ||
      parser.parse(std::span(words).subspan(1), ignored, ignored).has_value() ||
      request.complaint())
    return std::nullopt;
  return request;
}

}  // namespace clamor
