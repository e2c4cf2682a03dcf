// import_options.h: what a command or an application asks of the import of a level.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace clamor {

struct ImportOptions {
  std::vector<std::string> emitters{};   // in the syntax of --emitter
  std::optional<std::string> sidecar{};  // instead of LEVEL.acoustics.json beside the level
  std::optional<std::string>
      material{};              // preset for materials without acoustic data, default "plaster"
  bool hidden_meshes = false;  // include nodes that the level hides
  // Patterns for the names of nodes, meshes and materials that are no surfaces, and of those that
  // are, whatever the rules of surface_rules.h say.
  std::vector<std::string> ignored{}, kept{};
  std::optional<std::string> scene{};  // name or number; default: that of the level, else the first
  std::vector<std::string> ignored_extensions{};  // required ones that do not refuse the level
  std::optional<std::uint64_t> seed{};  // of random delays; default: of the sidecar, else 1
};

}  // namespace clamor
