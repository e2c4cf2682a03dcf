// clamor_hooks_test.cpp: what the library tells an application that asks: its threads, and what no
// call can return.
#include <algorithm>
#include <atomic>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "runtime/clamor.h"
#include "tests/library/library_room.h"
#include "tests/library/telling_context.h"

namespace clamor {
namespace {

using testing::add_listener;
using testing::Context;
using testing::context_that_tells;
using testing::open_level;
using testing::Told;

TEST(ClamorHooks, TellOfEachThreadThatBeginsAndEnds) {
  Told told;
  {
    const Context context = context_that_tells(told, false);
    clamor_listener_options options{};
    options.bytes = sizeof(options);
    options.output = CLAMOR_OUTPUT_RECEIVERS;
    add_listener(context, open_level(context), options);
  }
  EXPECT_EQ(told.begun, told.ended);
  for (const char* name : {"sampler", "page loader", "sound loader"})
    EXPECT_GE(told.begun[name], 1);
  EXPECT_EQ(told.begun.size(), 3u);
  EXPECT_THAT(told.sentences, ::testing::IsEmpty());
}

TEST(ClamorHooks, TellOfNoThreadWhereTheCallerUpdates) {
  Told told;
  {
    const Context context = context_that_tells(told, true);
    add_listener(context, open_level(context));
  }
  EXPECT_THAT(told.begun, ::testing::IsEmpty());
}

// An archive that can be read no longer.
struct Archive {
  std::string bytes;
  std::atomic<bool> fails{false};
};

TEST(ClamorHooks, TellWhatCannotBeReadAnyMore) {
  Told told;
  Archive archive;
  {
    std::ifstream file(testing::room(), std::ios::binary);
    archive.bytes.assign(std::istreambuf_iterator<char>(file), {});
  }
  const Context context = context_that_tells(told, true);
  clamor_reader reader{};
  reader.bytes = sizeof(reader);
  reader.name = "hall in the archive";
  reader.size = archive.bytes.size();
  reader.user = &archive;
  reader.read = [](void* user, uint64_t offset, uint64_t count, void* into) -> int32_t {
    const auto& from = *static_cast<Archive*>(user);
    if (from.fails) return -1;
    std::copy_n(from.bytes.begin() + static_cast<std::ptrdiff_t>(offset), count,
                static_cast<char*>(into));
    return 0;
  };
  clamor_level level = 0;
  ASSERT_EQ(clamor_open_level_with(context.get(), &reader, &level, nullptr), CLAMOR_OK);
  const clamor_listener listener = add_listener(context, level);
  archive.fails = true;
  EXPECT_THAT(told.sentences, ::testing::IsEmpty());
  std::vector<float> block(2 * 480);
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(clamor_update(context.get(), 0, nullptr), CLAMOR_OK);
    ASSERT_EQ(clamor_render(context.get(), listener, block.data(), 480), CLAMOR_OK);
  }
  EXPECT_THAT(told.sentences, ::testing::Contains(::testing::HasSubstr("hall in the archive")));
  clamor_listener_statistics statistics{};
  statistics.bytes = sizeof(statistics);
  ASSERT_EQ(clamor_get_listener_statistics(context.get(), listener, &statistics), CLAMOR_OK);
  EXPECT_EQ(told.sentences.size(), statistics.failures);
}

}  // namespace
}  // namespace clamor
