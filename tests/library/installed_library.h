// installed_library.h: the installed tree, and the examples built against it as an application's
// build finds it.
#pragma once

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/build_paths.h"
#include "tests/library/library_room.h"
#include "tests/shell.h"

namespace clamor::testing {

// Flags of a test's builds: what takes long is to compile the examples, not to run them.
inline constexpr char kClientFlags[] = "-O0 -Wall -Wextra -Wpedantic -Werror";

// The suites that build and run clients: their parameter is the compiler, gcc or clang.
class InstalledLibrary : public ::testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() {
    namespace fs = std::filesystem;
    const fs::path build = fs::path(kProgram).parent_path();
    prefix_ =
        (fs::temp_directory_path() / ("clamor_installed_" + std::to_string(::getpid()))).string();
    run("cmake --install " + build.string() + " --prefix " + prefix_);
    for (const auto& entry : fs::recursive_directory_iterator(prefix_ + "/lib"))
      if (entry.path().filename() == "libclamor.so")
        libraries_ = entry.path().parent_path().string();
    ASSERT_NE(libraries_, "") << "there is no libclamor.so";
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(prefix_); }

  // The folder with the library, whose name depends on the system.
  static std::string libraries() { return libraries_; }
  static std::string examples() { return std::string(kSourceDir) + "/runtime/examples"; }
  static std::string cxx(const std::string& compiler) {
    return compiler == "clang" ? "clang++" : "g++";
  }

  // Configures and builds a project, or one target of it, and returns the folder of what was built.
  static std::string build(const std::string& sources, const std::string& name,
                           const std::string& compiler, const std::string& target = "all") {
    std::string built = prefix_ + "/" + name + "_" + compiler;
    run("cmake -S " + sources + " -B " + built + " -G Ninja -DCMAKE_PREFIX_PATH=" + prefix_ +
        " -DCMAKE_C_COMPILER=" + compiler + " -DCMAKE_CXX_COMPILER=" + cxx(compiler) +
        " -DCMAKE_C_FLAGS='" + kClientFlags + "' -DCMAKE_CXX_FLAGS='" + kClientFlags + "'");
    run("cmake --build " + built + " --target " + target);
    return built;
  }

  // What pkg-config says of the library and of others.
  static std::string by_pkg_config(const std::string& packages) {
    return " $(PKG_CONFIG_PATH=" + libraries() + "/pkgconfig pkg-config --cflags --libs " +
           packages + ") ";
  }

  static inline std::string prefix_, libraries_;
};

}  // namespace clamor::testing
