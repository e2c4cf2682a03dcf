// installed_bake_library_test.cpp: the installed baker as an application's build finds it: a C99
// program by CMake and by pkg-config.
#include <filesystem>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/build_paths.h"
#include "tests/shell.h"

namespace clamor {
namespace {

using testing::has;
using testing::run;

class InstalledBakeLibrary : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    namespace fs = std::filesystem;
    prefix_ = (fs::temp_directory_path() / ("clamor_baker_" + std::to_string(::getpid()))).string();
    run("cmake --install " + fs::path(testing::kProgram).parent_path().string() + " --prefix " +
        prefix_);
    for (const auto& entry : fs::recursive_directory_iterator(prefix_ + "/lib"))
      if (entry.path().filename() == "libclamor_bake.so")
        libraries_ = entry.path().parent_path().string();
    ASSERT_NE(libraries_, "") << "there is no libclamor_bake.so";
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(prefix_); }

  static std::string examples() { return std::string(testing::kSourceDir) + "/bake/examples"; }
  static void expect_it_bakes(const std::string& program, const std::string& out) {
    EXPECT_THAT(run(program + " " + out + " 2000 2>/dev/null"),
                ::testing::HasSubstr("sources, T30"));
    EXPECT_THAT(run(std::string(testing::kProgram) + " inspect " + out + " --verify"),
                ::testing::HasSubstr("an application, through libclamor_bake"));
  }

  static inline std::string prefix_, libraries_;
};

TEST_F(InstalledBakeLibrary, IsFoundByCMakeInC99_NoAsan) {
  const std::string built = prefix_ + "/built";
  run("cmake -S " + examples() + " -B " + built + " -G Ninja -DCMAKE_PREFIX_PATH=" + prefix_ +
      " -DCMAKE_C_FLAGS='-Wall -Wextra -Wpedantic -Werror'");
  run("cmake --build " + built);
  expect_it_bakes(built + "/bake_box", prefix_ + "/cmake.clamor");
}

TEST_F(InstalledBakeLibrary, IsFoundByPkgConfigWithClang_NoAsan) {
  if (!has("pkg-config")) GTEST_SKIP() << "not on this machine: pkg-config";
  if (!has("clang")) GTEST_SKIP() << "not on this machine: clang";
  const std::string program = prefix_ + "/by_pkg_config";
  run("clang -std=c99 -Wall -Wextra -Wpedantic -Werror " + examples() + "/bake_box.c -o " +
      program + " $(PKG_CONFIG_PATH=" + libraries_ +
      "/pkgconfig pkg-config --cflags --libs clamor_bake) -lm");
  expect_it_bakes("LD_LIBRARY_PATH=" + libraries_ + " " + program, prefix_ + "/clang.clamor");
}

TEST_F(InstalledBakeLibrary, ShowsNothingButItsInterfaceAndLinksNoSoundDevice_NoAsan) {
  const std::string library = libraries_ + "/libclamor_bake.so";
  std::istringstream symbols(run("nm -D --defined-only " + library));
  std::string address, kind, name;
  int count = 0;
  while (symbols >> address >> kind >> name) {
    EXPECT_TRUE(name.starts_with("clamor_bake_")) << name;
    ++count;
  }
  EXPECT_GT(count, 12);
  const std::string needed = run("objdump -p " + library + " | grep -E 'NEEDED|SONAME'");
  EXPECT_THAT(needed, ::testing::HasSubstr("libclamor_bake.so.0"));
  for (const char* device : {"rtaudio", "jack", "pulse", "asound", "portaudio"})
    EXPECT_THAT(needed, ::testing::Not(::testing::HasSubstr(device)));
}

}  // namespace
}  // namespace clamor
