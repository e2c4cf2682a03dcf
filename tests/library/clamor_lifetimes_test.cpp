// clamor_lifetimes_test.cpp: what is left when levels are closed, and when the library is unloaded;
// and whether programs run that use the library as games do, one of the first release among them.
#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <malloc.h>

#include "runtime/clamor.h"
#include "tests/build_paths.h"
#include "tests/library/library_room.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using testing::add_listener;
using testing::Context;
using testing::make_context;
using testing::offline;
using testing::open_level;

// Bytes that malloc() has given out.
std::size_t allocated_bytes() {
  ::malloc_trim(0);
  const auto memory = ::mallinfo2();
  return memory.uordblks + memory.hblkhd;
}

// Opens a level, moves a listener into it, plays for a moment and closes the level before.
void visit_a_level(const Context& context, clamor_listener listener, clamor_level& visited) {
  std::array<float, 2 * 960> block{};
  const clamor_level next = open_level(context);
  EXPECT_EQ(clamor_enter_level(context.get(), listener, next, nullptr), CLAMOR_OK);
  EXPECT_EQ(clamor_close_level(context.get(), visited), CLAMOR_OK);
  for (int i = 0; i < 10; ++i) {  // longer than the crossfade
    EXPECT_EQ(clamor_update(context.get(), 0.01, nullptr), CLAMOR_OK);
    EXPECT_EQ(clamor_render(context.get(), listener, block.data(), 960), CLAMOR_OK);
  }
  visited = next;
}

TEST(ClamorLifetimes, AHundredLevelsLeaveNoMemoryBehind) {
  if (testing::kSanitized) GTEST_SKIP() << "sanitizers count leaks themselves";
  const Context context = make_context();
  clamor_level level = open_level(context);
  clamor_listener_options options = offline();
  options.offline = 0;
  const clamor_listener listener = add_listener(context, level, options);
  constexpr int kWarmUp = 10, kLevels = 100;
  for (int i = 0; i < kWarmUp; ++i) visit_a_level(context, listener, level);
  const std::size_t before = allocated_bytes();
  for (int i = 0; i < kLevels; ++i) visit_a_level(context, listener, level);
  // Embree keeps 300 bytes for each thread that built a BVH. One level of a hundred that stays
  // would be a megabyte.
  EXPECT_LT(allocated_bytes(), before + 100'000);
}

std::string program(const std::string& name) {
  return (std::filesystem::path(testing::kProgram).parent_path() / "tests" / name).string();
}

TEST(ClamorLifetimes, TheLibraryMayBeUnloadedAndLoadedAHundredTimes) {
  if (testing::kSanitized) GTEST_SKIP() << "a sanitizer must be loaded before the library";
  const auto library = std::filesystem::path(testing::kProgram).parent_path() / "libclamor.so";
  const std::string command =
      program("reopened_library") + " " + library.string() + " " + testing::room();
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
}

TEST(ClamorLifetimes, AProgramOfTheFirstReleaseStillRuns) {
  const std::string command = program("first_release_client") + " " + testing::room();
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
}

TEST(ClamorLifetimes, AProgramInCppOpensDoorsAndPortalsAndChangesReverberation_NoAsan) {
  const std::string command = program("cpp_client") + " " + testing::rooms_with_door();
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
}

}  // namespace
}  // namespace clamor
