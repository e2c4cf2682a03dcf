// other_processor_test.cpp: a bake and an offline render on a processor of 2008, with SSE4.2 and
// without AVX and FMA, which QEMU imitates (Debian: qemu-user-static), against those on this one.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "formats/audio/audio_file.h"
#include "tests/build_paths.h"
#include "tests/shell.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {
namespace {

constexpr const char* kEmulator = "qemu-x86_64-static";

TEST(OtherProcessor, MakesTheSameBytesAndSamplesButForRounding_NoAsan) {
  if (!has(kEmulator)) GTEST_SKIP() << "not on this machine: " << kEmulator;
  const Folder folder;
  std::string bakes[2], sounds[2];
  for (const int other : {0, 1}) {
    const std::string clamor = (other ? std::string(kEmulator) + " -cpu Nehalem " : "") + kProgram;
    const std::string name = folder / std::to_string(other);
    run(clamor + " bake " + violin_room() + " -o " + name +
        ".clamor --photons 300 --sources 3000 --no-journal --quiet --threads 1");
    sounds[other] = name + ".wav";
    run(clamor + " render " + (folder / "0.clamor") + " -o " + sounds[other] +
        " --listener 0,1.7,3 --seconds 0.3 --portable --quiet");
    bakes[other] = read(name + ".clamor");
  }
  EXPECT_TRUE(bakes[0] == bakes[1]);
  const auto here = read_audio(sounds[0]), there = read_audio(sounds[1]);
  ASSERT_TRUE(here.ok() && there.ok());
  ASSERT_EQ(here->size(), there->size());
  double power = 0, difference = 0;
  for (std::size_t i = 0; i < here->size(); ++i) {
    power += std::pow((*here)[i], 2);
    difference += std::pow((*there)[i] - (*here)[i], 2);
  }
  ASSERT_GT(power, 0);
  EXPECT_LT(10 * std::log10(difference / power), -110);
}

}  // namespace
}  // namespace clamor::testing
