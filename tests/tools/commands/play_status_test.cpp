#include "tools/commands/play_status.h"

#include <gtest/gtest.h>

namespace clamor {
namespace {

TEST(SoundsLine, SaysWhatAllSoundsTakeAndWhetherTheyFit) {
  SoundStatistics sounds;
  sounds.all_bytes = sounds.budget_bytes = 40'750'000;
  EXPECT_EQ(sounds_line(sounds), "sounds: 40.8 MB decoded, all of which fits into memory");
  sounds.budget_bytes = 16'000'000;
  EXPECT_EQ(
      sounds_line(sounds),
      "sounds: 40.8 MB decoded, of which 16.0 MB fit into memory, the loudest first; --memory "
      "82MB holds all");
}

}  // namespace
}  // namespace clamor
