// signal_block_cache.h: samples of a signal from any frame on, out of the blocks that a file keeps
// it in.
//
// A few blocks are kept decoded, because several pieces (prepared_signal.h) are made of each.
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

// What a file says of a signal before it is decoded.
struct SignalDescription {
  std::uint64_t frames = 0;
  bool loop = false;
  Bands mean_square{};  // as its envelope has it
  // The signal that a loop may be played from at first: whoever plays that plays the loop next.
  std::uint32_t onset = 0xffffffff;
};

class SignalBlockCache {
 public:
  static constexpr std::uint64_t kBlockBytes = kSignalBlockFrames * sizeof(float);

  // The samples of a signal's block; may be called by several threads at a time.
  using Decode = std::function<Result<std::vector<float>>(std::size_t signal, std::size_t block)>;

  // Keeps that many blocks.
  SignalBlockCache(Decode decode, std::size_t kept) : decode_(std::move(decode)), most_(kept) {}

  // Frames before and after a signal that plays once are 0; a loop comes round.
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
  const std::size_t most_;
  std::mutex mutex_;
  std::vector<Kept> kept_;  // the last used last
};

}  // namespace clamor
