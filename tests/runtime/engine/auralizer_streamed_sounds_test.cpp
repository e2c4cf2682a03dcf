// auralizer_streamed_sounds_test.cpp: levels whose sounds are longer than the memory given to them.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>

#include "common/random.h"
#include "common/sample_rate.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/streaming/sound_residency.h"
#include "tests/city.h"
#include "tests/sanitized.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

Signal noise(std::uint64_t seed, std::size_t frames, bool loop) {
  Signal signal{"noise " + std::to_string(seed), {}, loop};
  for (std::uint32_t i = 0; i < frames; ++i)
    signal.samples.push_back(static_cast<float>(0.6 * (unit(philox(seed, {i, 0, 0, 0})[0]) - 0.5)));
  return signal;
}

// Stands of fans, instanced with offsets of whole seconds; each instance maps the signals anew.
class AuralizerStreamedSounds : public ::testing::Test {
 protected:
  AuralizerStreamedSounds() {
    BakeContents contents = testing::city({3, 2, 2, 1, 1}, 1);
    contents.signals = {noise(1, 481 * kSampleRate_hz / 20 + 5, true),
                        noise(2, 21 * kSampleRate_hz, false), noise(3, 4800, true)};
    // The loop reaches its end within the first second; the other sound starts at 0.5 s.
    contents.emitters[0].delay_s = 1;
    contents.emitters[1].delay_s = 0.5;
    for (SourceOctree& tree : contents.prototypes)
      for (Source& source : tree.sources)
        source.delay_s += static_cast<float>(contents.emitters[source.emitter].delay_s);
    testing::write(contents, file_);
  }

  std::shared_ptr<const BakeFile> file() const { return testing::opened(file_); }

  // Renders a second and a half.
  static std::vector<float> heard(Auralizer& auralizer) {
    const std::size_t block = 960 * static_cast<std::size_t>(auralizer.channels());
    std::vector<float> out(75 * block);
    for (std::size_t done = 0; done < out.size(); done += block) {
      while (auralizer.wants_keyframe()) {
        const double t = auralizer.next_keyframe_time_s();
        auralizer.make_keyframe({{5 + 10 * t, 2, 20 - 3 * t}, t, 0});
      }
      auralizer.mix({out.data() + done, block});
    }
    return out;
  }

  const testing::TemporaryFile file_{".clamor"};
};

AuralizerOptions options(std::uint64_t memory_bytes) {
  AuralizerOptions made;
  made.voices = 100;  // more than there are sources
  made.wait_for_pages = true;
  made.memory_bytes = memory_bytes;
  return made;
}

TEST_F(AuralizerStreamedSounds, AreBitIdenticalToSoundsDecodedInAdvance_NoAsan) {
  for (const bool panned : {false, true}) {       // panned voices have one delay each
    if (testing::kSanitized && panned) continue;  // slow
    AuralizerOptions asked = options(6'000'000);
    if (panned) asked.output = *OutputFormat::from_options(false, "", true);
    const auto streamed = Auralizer::create(file(), asked);
    auto input = read_auralizer_input(*file());
    ASSERT_TRUE(input.ok());
    const auto decoded = Auralizer::create(std::move(*input), asked);
    ASSERT_TRUE(streamed.ok() && decoded.ok());
    const auto expected = heard(**decoded), got = heard(**streamed);
    EXPECT_EQ(expected, got);
    EXPECT_GT(*std::max_element(got.begin(), got.end()), 1e-3f);
    const SoundStatistics sounds = (*streamed)->statistics().sounds;
    EXPECT_EQ(sounds.late, 0u);
    EXPECT_EQ(sounds.failed, 0u);
    EXPECT_GT(sounds.loaded, 5u);
    EXPECT_LT(sounds.resident, 20u);  // as many as all sounds together have
  }
}

TEST_F(AuralizerStreamedSounds, SkipADamagedBlockAndNameIt) {
  {
    std::fstream bytes(file_.path(), std::ios::binary | std::ios::in | std::ios::out);
    std::string all((std::istreambuf_iterator<char>(bytes)), {});
    const std::size_t first = all.find("fLaC");  // first of three blocks of the first signal
    ASSERT_NE(first, std::string::npos);
    const std::size_t second = all.find("fLaC", first + 4);
    bytes.clear();
    bytes.seekp(static_cast<std::streamoff>(second + 1000));
    bytes << "damage";
  }
  const auto auralizer = Auralizer::create(file(), options(60'000'000));
  ASSERT_TRUE(auralizer.ok());
  const auto out = heard(**auralizer);
  EXPECT_GT(*std::max_element(out.begin(), out.end()), 1e-3f);
  const SoundStatistics sounds = (*auralizer)->statistics().sounds;
  EXPECT_NE(sounds.failure.find("'noise 1' (block 2 of 3) fails its checksum"), std::string::npos)
      << sounds.failure;
  EXPECT_GT(sounds.failed, 0u);
  EXPECT_GT(sounds.loaded, 0u);
}

}  // namespace
}  // namespace clamor
