// signal_block_cache.h: reads samples of a signal from any frame on, from the compressed blocks of
// a file.
//
// Keeps the most recently used blocks decoded, because several pieces (prepared_signal.h) are made
// from each block.
//
// Threads: any, several at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "common/bands.h"
#include "common/result.h"
#include "formats/bake_file/signal_section.h"

namespace clamor {

// A signal's description in the file.
struct SignalDescription {
  std::uint64_t frames = 0;
  bool loop = false;
  Bands mean_square{};  // from the envelope
  // The signal that a loop starts with, if it begins from silence (keyframe_maker.h). A voice that
  // plays the onset plays the loop next.
  std::uint32_t onset = 0xffffffff;
};

class SignalBlockCache {
 public:
  static constexpr std::uint64_t kBlockBytes = kSignalBlockFrames * sizeof(float);

  // Decodes one block of a signal. Several threads may call it at once.
  using Decode = std::function<Result<std::vector<float>>(std::size_t signal, std::size_t block)>;

  // `kept` is the capacity in blocks.
  SignalBlockCache(Decode decode, std::size_t kept) : decode_(std::move(decode)), max_kept_(kept) {}

  // Frames outside a signal that plays once are 0; a loop repeats.
  Result<std::vector<double>> read(std::size_t signal, const SignalDescription& shape,
                                   std::int64_t first, std::size_t frames);

 private:
  using Block = std::shared_ptr<const std::vector<float>>;
  struct Kept {
    std::size_t signal = 0, block = 0;
    Block samples;
  };
  Result<Block> block(std::size_t signal, std::size_t block, bool keep);

  const Decode decode_;
  const std::size_t max_kept_;
  std::mutex mutex_;
  std::vector<Kept> kept_;  // least recently used first
};

}  // namespace clamor
