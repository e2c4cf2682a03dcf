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
  bool hidden_meshes = false;  // include nodes that KHR_node_visibility hides
  std::optional<std::uint64_t> seed{};  // of random delays; default: of the sidecar, else 1
};

}  // namespace clamor
