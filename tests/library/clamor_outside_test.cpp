// clamor_outside_test.cpp: the C interface warns of listeners, sources and places to measure that
// are outside of their level.
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "runtime/clamor.h"
#include "tests/library/library_room.h"
#include "tests/library/telling_context.h"

namespace clamor {
namespace {

using testing::add_listener;
using ::testing::AllOf;
using testing::Context;
using testing::context_that_tells;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::offline;
using testing::open_level;
using testing::room;
using testing::Told;

// The room lies between 0,0,0 and 6,8,3.
auto is_outside(const char* thing_at) {
  return AllOf(HasSubstr(room()), HasSubstr(thing_at),
               HasSubstr("is outside the level, which lies between 0,0,0 and 6,8,3"));
}

struct HeardRoom {
  Told told;
  const Context context = context_that_tells(told, true);
  const clamor_level level = open_level(context);
  const clamor_listener listener = add_listener(context, level);

  void play(int blocks) const {
    std::vector<float> block(2 * 960);
    for (int i = 0; i < blocks; ++i) {
      ASSERT_EQ(clamor_update(context.get(), 0, nullptr), CLAMOR_OK);
      ASSERT_EQ(clamor_render(context.get(), listener, block.data(), 960), CLAMOR_OK);
    }
  }
  void move_to(double x_m) const {
    const clamor_pose pose = {{x_m, 4, 1.6}, {0, 0, 0, 1}};
    ASSERT_EQ(clamor_move_listener(context.get(), listener, &pose), CLAMOR_OK);
  }
};

TEST(ClamorOutside, WarnsOnceOfAListener) {
  const HeardRoom heard;
  heard.play(5);
  EXPECT_THAT(heard.told.sentences, IsEmpty());
  for (const double x_m : {100.0, 101.0, 2.0, 100.0}) {
    heard.move_to(x_m);
    heard.play(5);
  }
  EXPECT_THAT(heard.told.sentences, ElementsAre(is_outside("the listener at 100,4,1.6")));
}

TEST(ClamorOutside, WarnsAgainInAnotherLevel) {
  HeardRoom heard;
  heard.move_to(100);
  heard.play(5);
  heard.told.sentences.clear();
  const clamor_level other = open_level(heard.context);
  ASSERT_EQ(clamor_enter_level(heard.context.get(), heard.listener, other, nullptr), CLAMOR_OK);
  heard.play(20);
  EXPECT_THAT(heard.told.sentences, ElementsAre(is_outside("the listener at 100,4,1.6")));
}

TEST(ClamorOutside, WarnsOnceOfSources) {
  const HeardRoom heard;
  clamor_context* const context = heard.context.get();
  const std::vector<float> samples(4800, 0.1f);
  clamor_source_options options{};
  options.bytes = sizeof options;
  ASSERT_EQ(
      clamor_add_sound(context, samples.data(), samples.size(), nullptr, &options.sound, nullptr),
      CLAMOR_OK);
  options.motion.position_m[0] = 3;
  clamor_source source = 0;
  ASSERT_EQ(clamor_add_source(context, &options, &source), CLAMOR_OK);
  ASSERT_EQ(clamor_commit(context, 0), CLAMOR_OK);
  heard.play(3);
  EXPECT_THAT(heard.told.sentences, IsEmpty());
  for (const double y_m : {-300.0, -301.0}) {
    options.motion.position_m[1] = y_m;
    ASSERT_EQ(clamor_move_source(context, source, &options.motion), CLAMOR_OK);
    ASSERT_EQ(clamor_commit(context, 0), CLAMOR_OK);
    heard.play(3);
  }
  EXPECT_THAT(heard.told.sentences, ElementsAre(is_outside("a source at 3,-300,0")));
}

TEST(ClamorOutside, WarnsOnceOfPlacesToMeasure) {
  Told told;
  const Context context = context_that_tells(told, true);
  const std::vector<double> places_m = {2, 4, 1.6, 2, 160, 4, 2, 161, 4};
  std::vector<float> samples(3 * 100);
  ASSERT_EQ(clamor_measure_responses(context.get(), open_level(context), 0, places_m.data(), 3,
                                     samples.data(), 100, nullptr, nullptr),
            CLAMOR_OK);
  EXPECT_THAT(told.sentences, ElementsAre(is_outside("the receiver at 2,160,4")));
}

}  // namespace
}  // namespace clamor
