// source_tree.h: the repository as text, for tests that read it.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tests/build_paths.h"

namespace clamor::testing {

inline const std::filesystem::path kRoot = kSourceDir;

// The folders of each library from the bottom up: each may include those before it, and files
// outside of a folder may include all.
inline const std::map<std::string, std::vector<std::string>> kFolders = {
    {"common",
     {"platform", "platform/posix", "platform/none", "platform/windows", "platform/wasm"}},
    {"formats", {"files", "audio", "level", "gltf", "bake_file", "blender"}},
    {"bake",
     {"mesh", "trace", "early", "octree", "instances", "journal", "portals", "report", "probes",
      "examples"}},
    {"runtime",
     {"realtime",
      "voices",
      "propagation",
      "occlusion",
      "streaming",
      "query",
      "sampling",
      "probes",
      "hrtf",
      "field",
      "mixing",
      "engine",
      "response",
      "world",
      "output",
      "player",
      "examples",
      "examples/love",
      "bindings",
      "bindings/csharp",
      "bindings/godot",
      "bindings/godot/addons",
      "bindings/godot/addons/clamor",
      "bindings/godot/addons/clamor/editor",
      "bindings/godot/addons/clamor/icons",
      "bindings/godot/demo",
      "bindings/godot/pictures",
      "bindings/lua",
      "bindings/python",
      "bindings/python/clamor",
      "bindings/web",
      "bindings/web/examples"}},
    {"tools",
     {"program", "strategies", "analysis", "bench", "experiments", "farm", "report", "report/page",
      "view", "view/window", "commands", "packaging", "packaging/vcpkg", "packaging/conan",
      "packaging/conan/test_package", "packaging/windows", "packaging/arm64"}},
};

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

// All files of a folder and the folders in it, relative to the root, sorted; "" is the whole
// repository without what Git and builds keep there.
inline std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> files;
  const auto ours = [](const std::string& path) {
    return !path.starts_with("build") && !path.starts_with(".git/") && path != ".git" &&
           !path.starts_with(".cache");
  };
  for (auto entry = std::filesystem::recursive_directory_iterator(kRoot / folder);
       entry != std::filesystem::recursive_directory_iterator(); ++entry) {
    const std::string path = entry->path().lexically_relative(kRoot).generic_string();
    if (!ours(path))
      entry.disable_recursion_pending();
    else if (entry->is_regular_file())
      files.push_back(path);
  }
  std::sort(files.begin(), files.end());
  return files;
}

inline bool is_code(std::string_view path) {
  return path.ends_with(".cpp") || path.ends_with(".h") || path.ends_with(".h.in");
}

}  // namespace clamor::testing
