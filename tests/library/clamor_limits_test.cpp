// clamor_limits_test.cpp: what the C interface does at its limits: as many objects as a context
// holds, structures that are too large, many contexts at once.
#include <array>
#include <cstdint>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/clamor.h"
#include "tests/library/library_room.h"

namespace clamor {
namespace {

using testing::add_listener;
using testing::Context;
using testing::make_context;
using testing::offline;
using testing::open_level;

TEST(ClamorLimits, AFullContextRefusesMoreAndIsAsBefore) {
  const Context context = make_context();
  std::vector<clamor_level> levels;
  for (int i = 0; i < 256; ++i) levels.push_back(open_level(context));
  clamor_level more = 77;
  const std::string& path = testing::room();
  EXPECT_EQ(clamor_open_level(context.get(), path.c_str(), &more, nullptr), CLAMOR_ERROR_FULL);
  EXPECT_EQ(more, 77u);
  EXPECT_EQ(clamor_close_level(context.get(), levels[99]), CLAMOR_OK);
  EXPECT_EQ(clamor_open_level(context.get(), path.c_str(), &more, nullptr), CLAMOR_OK);

  for (int i = 0; i < 64; ++i) add_listener(context, levels[0]);
  const clamor_listener_options options = offline();
  clamor_listener listener = 77;
  EXPECT_EQ(clamor_create_listener(context.get(), levels[0], &options, &listener, nullptr),
            CLAMOR_ERROR_FULL);
  EXPECT_EQ(listener, 77u);
}

// An uninitialised `bytes` must not make the library read or write megabytes.
TEST(ClamorLimits, AStructureOfASizeThatWasNeverSetIsRefused) {
  const Context context = make_context();
  const clamor_level level = open_level(context);
  clamor_level_info info{};
  info.bytes = 0xbebebebe;
  EXPECT_EQ(clamor_get_level_info(context.get(), level, &info), CLAMOR_ERROR_ARGUMENT);
  clamor_options options{};
  options.bytes = 4097;
  clamor_context* none = nullptr;
  EXPECT_EQ(clamor_create(&options, &none, nullptr), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(none, nullptr);
}

TEST(ClamorLimits, HandlesOfAllContextsDiffer) {
  std::vector<Context> contexts;
  std::set<clamor_level> levels;
  for (int i = 0; i < 400; ++i) {
    contexts.push_back(make_context());
    EXPECT_TRUE(levels.insert(open_level(contexts.back())).second) << "context " << i;
  }
}

TEST(ClamorLimits, AHandleWithAnyOneBitChangedIsNone) {
  const Context context = make_context();
  const clamor_listener listener = add_listener(context, open_level(context));
  std::array<float, 32> block{};
  uint32_t channels = 0;
  ASSERT_EQ(clamor_render(context.get(), listener, block.data(), 16), CLAMOR_OK);
  for (int bit = 0; bit < 64; ++bit) {
    const clamor_listener wrong = listener ^ uint64_t { 1 } << bit;
    EXPECT_EQ(clamor_render(context.get(), wrong, block.data(), 16), CLAMOR_ERROR_HANDLE) << bit;
    EXPECT_EQ(clamor_get_channels(context.get(), wrong, &channels), CLAMOR_ERROR_HANDLE) << bit;
  }
}

TEST(ClamorLimits, LoudspeakersAreAPairUnlessALayoutIsNamed) {
  const Context context = make_context();
  clamor_listener_options options = offline();
  options.output = CLAMOR_OUTPUT_LOUDSPEAKERS;
  const clamor_listener listener = add_listener(context, open_level(context), options);
  std::uint32_t channels = 0;
  EXPECT_EQ(clamor_get_channels(context.get(), listener, &channels), CLAMOR_OK);
  EXPECT_EQ(channels, 2u);
  std::array<float, 960> block{};
  double energy = 0;
  for (int i = 0; i < 50; ++i) {
    ASSERT_EQ(clamor_update(context.get(), 0, nullptr), CLAMOR_OK);
    ASSERT_EQ(clamor_render(context.get(), listener, block.data(), 480), CLAMOR_OK);
    for (const float sample : block) energy += static_cast<double>(sample) * sample;
  }
  EXPECT_GT(energy, 0);
}

// Another context that plays in the same process does not change what a listener hears.
TEST(ClamorLimits, ContextsDoNotHearEachOther) {
  const auto heard = [](bool with_another) {
    const Context context = make_context(), other = make_context();
    const clamor_listener listener = add_listener(context, open_level(context));
    clamor_listener_options loud = offline();
    loud.gain = 8;
    const clamor_listener another = add_listener(other, open_level(other), loud);
    std::vector<float> samples(2 * 48'000);
    for (std::size_t done = 0; done < samples.size(); done += 2 * 480) {
      uint32_t made = 1;
      while (made > 0) EXPECT_EQ(clamor_update(context.get(), 0, &made), CLAMOR_OK);
      if (with_another) {
        std::array<float, 2 * 333> block{};
        const clamor_pose pose = {{5, 2, 1}, {0, 0, 0, 1}};
        EXPECT_EQ(clamor_move_listener(other.get(), another, &pose), CLAMOR_OK);
        EXPECT_EQ(clamor_update(other.get(), 0, nullptr), CLAMOR_OK);
        EXPECT_EQ(clamor_render(other.get(), another, block.data(), 333), CLAMOR_OK);
      }
      EXPECT_EQ(clamor_render(context.get(), listener, &samples[done], 480), CLAMOR_OK);
    }
    return samples;
  };
  EXPECT_EQ(heard(true), heard(false));
}

}  // namespace
}  // namespace clamor
