#include "common/sample_rate.h"
#include "formats/audio/audio_file.h"
#include "formats/audio/wav_writer.h"
#include "formats/bake_file/bake_layout.h"
#include "tests/formats/forged_root.h"
#include "tests/peak_memory.h"
#include "tests/sanitized.h"

namespace clamor::testing {
namespace {

// Returns the file with another block for its only signal, and valid checksums.
Bytes with_signal_block(const Bytes& whole, const Bytes& block) {
  std::uint64_t offset = 0, before = 0;
  const Bytes bytes = with_root(whole, [&](BakeRoot::Builder root) {
    auto signal = root.getSignals()[0];
    offset = signal.getBlockOffset()[0];
    before = signal.getBlockBytes()[0];
    signal.getBlockBytes().set(0, static_cast<std::uint32_t>(block.size()));
    signal.getBlockHash().set(0, hash_of(std::as_bytes(std::span(block))));
    move_what_follows(root, block.size() - before);
  });
  return with_bytes(bytes, offset, before, block);
}

TEST(HostileBakeFile, WithATooLongSignalIsNotDecodedBeyondItsLength) {
  const Bytes whole = written(contents());
  const auto flac_of = [](std::size_t frames) {
    const auto flac = encode_flac(std::vector<float>(frames, 0.0f));
    EXPECT_TRUE(flac.ok());
    return Bytes(reinterpret_cast<const char*>(flac->data()), flac->size());
  };
  const auto right = read_whole(with_signal_block(whole, flac_of(300)));
  ASSERT_TRUE(right.ok()) << right.error().message;
  const Bytes bomb = with_signal_block(whole, flac_of(std::size_t{kSampleRate_hz} * 300));
  const PeakMemory peak;
  const auto read = read_whole(bomb);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("has the wrong length"), std::string::npos)
      << read.error().message;
  if (peak.known() && !kSanitized) {
    EXPECT_LT(peak.more_bytes(), 20'000'000u);  // five minutes are 58 MB of samples
  }
}

TEST(HostileBakeFile, WithASignalOtherThanFlacIsRejected) {
  const Bytes whole = written(contents());
  const std::string path = path_of("signal.wav");
  {
    auto wav = WavWriter::create(path, 1, kSampleRate_hz, SampleFormat::kPcm16);
    ASSERT_TRUE(wav.ok());
    ASSERT_TRUE(wav->write(std::vector<float>(300, 0.5f)).ok());
    ASSERT_TRUE(wav->finish().ok());
  }
  const auto read_wav = read_whole(with_signal_block(whole, read(path)));
  std::filesystem::remove(path);
  ASSERT_FALSE(read_wav.ok());
  EXPECT_NE(read_wav.error().message.find("is no FLAC stream"), std::string::npos)
      << read_wav.error().message;
}

}  // namespace
}  // namespace clamor::testing
