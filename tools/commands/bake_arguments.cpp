#include "tools/commands/bake_arguments.h"

#include <filesystem>
#include <span>
#include <sstream>

#include "common/utf8_path.h"

namespace clamor {

void add_import_options(Arguments& parser, ImportOptions& options) {
  parser.option("--emitter", options.emitters,
                "add an emitter, as in signal=FILE,at=X,Y,Z; the signal may also be noise or "
                "impulse; further fields: name=NAME, facing=X,Y,Z, gain=-6dB, directivity=P, "
                "delay=S, loop=no; may be repeated");
  parser.option("--acoustics", options.sidecar,
                "sidecar file to use instead of LEVEL.acoustics.json");
  parser.option("--material", options.material,
                "preset for materials without acoustic data [plaster]");
  parser.flag("--hidden", options.hidden_meshes, "include meshes that the level marks as hidden");
  parser.option("--ignore", options.ignored,
                "leave out the surfaces of nodes, meshes or materials of this name, as in 'UCX_*'; "
                "may be repeated");
  parser.option("--keep", options.kept,
                "take nodes, meshes or materials of this name for surfaces, whatever their names "
                "and transparency say; may be repeated");
  parser.option("--scene", options.scene,
                "name or number of the scene of the level to bake [its default scene]");
  parser.option("--ignore-required", options.ignored_extensions,
                "bake a level that requires this extension without it; may be repeated");
}

void add_bake_options(Arguments& parser, BakeRequest& request) {
  add_import_options(parser, request.import);
  parser.option(
      "--photons", request.photons,
      "photons to trace; more of them reduce noise, not the number of sources [unset: enough for "
      "--sources]");
  parser.option("--sources", request.sources,
                "maximum number of secondary sources to keep [unset: 200 000 per room with "
                "emitters, at most 6.4 million]");
  parser.option("--probes", request.probes,
                "places where moving sources will be heard with reflections: none but those of the "
                "level, auto, or the metres between them");
  parser.option("--probe-sources", request.probe_sources,
                "secondary sources of each probe [unset: 1600]");
  parser.option("--seed", request.seed,
                "seed of all random numbers; the same seed gives the same bytes [1]");
  parser.option(
      "--simplify", request.simplify_m,
      "remove triangles, moving surfaces by at most this many metres, as in 0.05 [0: off]");
  parser.option("--instances", request.instances,
                "on or off: store groups of emitters that the level repeats once, as instances");
  parser.words("--instances", {"on", "off"});
  parser.option(
      "--early-order", request.early_order,
      "reflections by mirrors that are image sources, heard exactly and in phase: 0 to 3, "
      "or auto, which takes 3 for up to 16 emitters and 0 for more than 256");
  parser.option(
      "--kappa", request.roulette_exponent,
      "exponent of Russian roulette, 0 to 1: a path survives with probability (power after / "
      "power before)^kappa");
  parser.option("--longest", request.longest_s,
                "longest path to trace, in seconds, up to 60 [10, or what a slower decay takes]");
}

std::string note_of(const BakeRequest& request) {
  std::string note = std::filesystem::absolute(path_of(request.level_path)).string();
  for (const std::string& word : request.words()) note += '\0' + word;
  return note;
}

std::optional<BakeRequest> request_from_note(const std::string& note) {
  std::vector<std::string> words{""};
  for (const char c : note)
    if (c == '\0')
      words.emplace_back();
    else
      words.back() += c;
  BakeRequest request;
  request.level_path = words[0];
  Arguments parser("merge", "", "");
  add_bake_options(parser, request);
  std::ostringstream ignored;
  if (request.level_path.empty() ||
      parser.parse(std::span(words).subspan(1), ignored, ignored).has_value() ||
      request.complaint())
    return std::nullopt;
  return request;
}

}  // namespace clamor
