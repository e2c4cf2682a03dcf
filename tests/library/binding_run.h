// binding_run.h: runs programs that use the built libraries, and the examples of pages.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/build_paths.h"
#include "tests/temporary_file.h"

namespace clamor::testing {

inline std::string build_folder() { return std::filesystem::path(kProgram).parent_path().string(); }

// Runs a shell command with the built libraries and returns what it printed; failing fails the
// test.
inline std::string run_with_libraries(const std::string& command) {
  const TemporaryFile output(".txt"), script(".sh", command);
  const std::string build = build_folder(), sources = kSourceDir;
  const int result = std::system(
      ("export LD_LIBRARY_PATH=" + build + " PATH=" + build + ":$PATH PYTHONDONTWRITEBYTECODE=1 " +
       "PYTHONPATH=" + sources + "/runtime/bindings/python CLAMOR_LIBRARY=" + build +
       "/libclamor.so; sh -e " + script.path() + " >" + output.path() + " 2>&1")
          .c_str());
  EXPECT_EQ(result, 0) << command << "\n" << output.bytes();
  return output.bytes();
}

// A small bake of the violin's room, made once by the program.
inline const std::string& violin_room() {
  static const TemporaryFile file(".clamor");
  static const std::string output = run_with_libraries(
      "clamor bake " + std::string(kSourceDir) + "/assets/levels/violin_room.glb -o " +
      file.path() + " --photons 300 --sources 1000 --no-journal");
  return file.path();
}

// An empty folder, removed at the end.
class EmptyFolder {
 public:
  EmptyFolder() : place_("_folder") { std::filesystem::create_directory(path()); }
  ~EmptyFolder() { std::filesystem::remove_all(path()); }
  std::string path() const { return place_.path(); }
  std::string operator/(const std::string& name) const { return path() + "/" + name; }

 private:
  const TemporaryFile place_;
};

inline std::string contents_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// The first code block of a page in a language, as in ```python, after a text.
inline std::string example_of(const std::string& page, const std::string& language,
                              const std::string& after = "") {
  const std::string text = contents_of(std::string(kSourceDir) + "/" + page);
  const std::string opening = "```" + language + "\n";
  const std::size_t begin = text.find(opening, text.find(after));
  if (begin == std::string::npos) {
    ADD_FAILURE() << page << " has no example in " << language;
    return "";
  }
  const std::size_t first = begin + opening.size();
  return text.substr(first, text.find("```", first) - first);
}

inline std::size_t line_count(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace clamor::testing
