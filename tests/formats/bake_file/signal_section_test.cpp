#include "formats/bake_file/signal_section.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/signal_envelope.h"

namespace clamor {
namespace {

// A sound without repetitions that encodes quickly.
Signal long_sound(std::size_t frames, float peak) {
  Signal signal{"long", {}, true};
  signal.samples.resize(frames);
  for (std::size_t i = 0; i < frames; ++i) {
    const auto t = static_cast<double>(i);
    signal.samples[i] = static_cast<float>(peak * std::sin(0.01 * t) * std::sin(1e-10 * t * t));
  }
  return signal;
}

struct Written {
  explicit Written(std::vector<Signal> signals) {
    BakeContents contents;
    contents.signals = std::move(signals);
    const auto done = write_bake(path, contents, 2);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
    auto opened = BakeFile::open(path);
    EXPECT_TRUE(opened.ok()) << (opened.ok() ? "" : opened.error().message);
    file = std::make_unique<BakeFile>(std::move(*opened));
  }
  ~Written() { std::filesystem::remove(path); }

  std::string path = ::testing::TempDir() + "signals.clamor";
  std::unique_ptr<BakeFile> file;
};

TEST(LongSignal, IsStoredInIndependentBlocks) {
  const Signal sound = long_sound(kSampleRate_hz * 25 + 17, 3);
  const Written written({long_sound(100, 1), sound});
  ASSERT_EQ(written.file->signal(0).blocks, 1u);
  ASSERT_EQ(written.file->signal(1).blocks, 3u);
  EXPECT_EQ(written.file->signal(1).frames, sound.samples.size());
  // Reads the last block alone.
  for (const std::size_t b : {2u, 0u, 1u}) {
    const SignalBlock where = signal_block(sound.samples.size(), b);
    const auto block = written.file->read_signal_block(1, b);
    ASSERT_TRUE(block.ok()) << block.error().message;
    ASSERT_EQ(block->size(), where.frames);
    for (std::size_t i = 0; i < block->size(); ++i)
      ASSERT_NEAR((*block)[i], sound.samples[where.first + i], 2.0 / (1 << 23)) << b << " " << i;
  }
  const auto whole = written.file->read_signal(1);
  ASSERT_TRUE(whole.ok());
  ASSERT_EQ(whole->samples.size(), sound.samples.size());
  for (std::size_t i = 0; i < sound.samples.size(); i += 97)
    ASSERT_NEAR(whole->samples[i], sound.samples[i], 2.0 / (1 << 23));
}

TEST(LongSignal, HasAnOverheadBelowATwentieth) {
  Signal noise{"noise", {}, true};
  for (std::uint32_t i = 0; i < 21 * kSampleRate_hz; ++i)
    noise.samples.push_back(static_cast<float>(unit(philox(1, {i, 0, 0, 0})[0]) - 0.5));
  const auto blocks = pack_signal_blocks(noise, 1);
  ASSERT_TRUE(blocks.ok());
  std::size_t in_blocks = 0;
  for (const auto& block : *blocks) in_blocks += block.size();
  noise.samples.resize(kMaxSingleBlock_frames);
  const auto uncut = pack_signal_blocks(noise, 1);
  ASSERT_EQ(uncut->size(), 1u);
  EXPECT_LT(static_cast<double>(in_blocks),
            1.05 * 21 / 20 * static_cast<double>((*uncut)[0].size()));
}

TEST(LongSignal, IsPartitionedByItsBlocks) {
  for (const std::uint64_t frames :
       {std::uint64_t{1}, kMaxSingleBlock_frames, kMaxSingleBlock_frames + 1,
        3 * kSignalBlockFrames, std::uint64_t{kSampleRate_hz} * 1800}) {
    std::uint64_t next = 0;
    for (std::size_t b = 0; b < signal_blocks(frames); ++b) {
      EXPECT_EQ(signal_block(frames, b).first, next);
      EXPECT_GT(signal_block(frames, b).frames, 0u);
      next += signal_block(frames, b).frames;
    }
    EXPECT_EQ(next, frames);
  }
}

TEST(LongSignal, KeepsOtherBlocksReadableIfOneIsDamaged) {
  const Written written({long_sound(kSampleRate_hz * 30, 1)});
  // Damages the second of three blocks.
  std::FILE* const bytes = std::fopen(written.path.c_str(), "r+b");
  std::fseek(bytes, static_cast<long>(written.file->bytes().signals / 2), SEEK_SET);
  std::fputs("damage", bytes);
  std::fclose(bytes);
  EXPECT_TRUE(written.file->read_signal_block(0, 0).ok());
  EXPECT_TRUE(written.file->read_signal_block(0, 2).ok());
  const auto damaged = written.file->read_signal_block(0, 1);
  ASSERT_FALSE(damaged.ok());
  EXPECT_NE(damaged.error().message.find("signal 'long' (block 2 of 3) fails its checksum"),
            std::string::npos)
      << damaged.error().message;
  EXPECT_FALSE(written.file->read_signal(0).ok());
}

TEST(SignalEnvelopeSection, RoundTrips) {
  std::vector<Signal> signals = {long_sound(100'000, 0.5f),
                                 {"click", {1, 0.5f}, false},
                                 {"nothing", std::vector<float>(3000, 0), true}};
  const Written written(signals);
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const SignalEnvelope made(signals[i]);
    const auto read = written.file->read_envelope(i);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->mean_square(), made.mean_square());
    EXPECT_TRUE(std::equal(read->steps().begin(), read->steps().end(), made.steps().begin(),
                           made.steps().end()));
  }
}

TEST(SignalEnvelopeSection, LongerThanItsSignalIsRejected) {
  const SignalEnvelope envelope(long_sound(5000, 1));
  const auto section = pack_envelope(envelope);
  EXPECT_TRUE(unpack_envelope(section, 5000, envelope.mean_square()).ok());
  EXPECT_FALSE(unpack_envelope(section, 4000, envelope.mean_square()).ok());
  EXPECT_FALSE(unpack_envelope(section, 50'000, envelope.mean_square()).ok());
  const auto bomb = packed(std::vector<std::byte>(100'000'000));
  EXPECT_FALSE(unpack_envelope(bomb, 5000, envelope.mean_square()).ok());
}

}  // namespace
}  // namespace clamor
