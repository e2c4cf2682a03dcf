#include "formats/level/emitter_spec.h"

#include <utility>

#include <gmock/gmock.h>

namespace clamor::testing {
namespace {

using ::testing::HasSubstr;

TEST(EmitterSpecs, AcceptCommasInsideLists) {
  const auto spec = parse_emitter(
      "name=violin,signal=my, old-violin=1.flac,at=1,1.2,-3,facing=0,0,2,gain=-6dB,"
      "directivity=1,2,3,4,5,6,7,8,delay=0.25,loop=no");
  ASSERT_TRUE(spec.ok()) << spec.error().message;
  EXPECT_EQ(spec->name, "violin");
  EXPECT_EQ(spec->signal, "my, old-violin=1.flac");
  EXPECT_EQ(spec->at_m, Vec3(1, 1.2, -3));
  EXPECT_EQ(spec->facing, Vec3(0, 0, 1));
  EXPECT_NEAR(spec->gain, 0.50119, 1e-5);
  EXPECT_EQ(spec->directivity[7], 8);
  EXPECT_EQ(spec->delay_s, 0.25);
  EXPECT_EQ(spec->loop, false);
}

// A bare number is ambiguous: a factor in sidecars, decibels in --gain.
TEST(EmitterSpecs, AcceptGainsInDecibelsOrAsFactorsButNoBareNumbers) {
  EXPECT_DOUBLE_EQ(*parse_gain("20dB"), 10);
  EXPECT_DOUBLE_EQ(*parse_gain("-20 DB"), 0.1);
  EXPECT_DOUBLE_EQ(*parse_gain("40db"), 100);
  EXPECT_EQ(*parse_gain("200dB", 1e10), 1e10);
  EXPECT_FALSE(parse_gain("200.1dB", 1e10).ok());
  EXPECT_DOUBLE_EQ(*parse_gain("x2"), 2);
  EXPECT_DOUBLE_EQ(*parse_gain("X0.5"), 0.5);
  const auto alone = parse_gain("6");
  ASSERT_FALSE(alone.ok());
  EXPECT_THAT(alone.error().message, HasSubstr("6dB or x6"));
  EXPECT_FALSE(parse_gain("x6dB").ok());
  EXPECT_FALSE(parse_gain("x-1").ok());
  EXPECT_FALSE(parse_gain("81dB").ok());
  EXPECT_TRUE(parse_gain("81dB", 1e10).ok());
}

TEST(EmitterSpecs, AreRejectedWithAnExampleToCopy) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "nearest"},
      {"at=1,2,3", "signal= is missing"},
      {"signal=a.wav", "at= is missing"},
      {"signal=a.wav,at=1,2", "three numbers"},
      {"signal=a.wav,at=1,2,nan", "three numbers"},
      {"signal=a.wav,at=1,2,1e300", "three numbers"},
      {"signal=a.wav,at=1,2,3,facing=0,0,0", "no direction"},
      {"signal=a.wav,at=1,2,3,gain=loud", "decibels"},
      {"signal=a.wav,at=1,2,3,gain=-1", "decibels"},
      {"signal=a.wav,at=1,2,3,gain=900dB", "decibels"},
      {"signal=a.wav,at=1,2,3,directivity=1,2", "2 values"},
      {"signal=a.wav,at=1,2,3,directivity=-1", "must be from 0"},
      {"signal=a.wav,at=1,2,3,delay=-1", "seconds"},
      {"signal=a.wav,at=1,2,3,loop=maybe", "loop=yes or loop=no"},
      {"signal=a.wav,at=1,2,3,at=1,2,3", "twice"},
      {"signal=a.wav,at=1,2,3,direktivity=2", "'directivity'"},
      {"signal=a.wav,position=1,2,3", "the nearest is 'at'"},
      {"signal=a.wav,at=1,2,3,Direction=1,0,0", "the nearest is 'facing'"},
      {"signal=a.wav,at=1,2,3,gain=-6", "could only be decibels; write -6dB."},
      {"signal=a.wav,at=1,2,3,gain=6", "write 6dB or x6."},
      {"signal=,at=1,2,3", "is empty"}};
  for (const auto& [text, part] : cases) {
    const auto spec = parse_emitter(text);
    ASSERT_FALSE(spec.ok()) << text;
    EXPECT_THAT(spec.error().message, HasSubstr(part)) << text;
  }
}

}  // namespace
}  // namespace clamor::testing
