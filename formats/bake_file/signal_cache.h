// signal_cache.h: encoded signals, for programs that write several bakes with the same sounds.
//
// Encoding the sounds and finding their envelopes takes much of the time of a bake of few photons.
//
// Threads: one at a time. Memory: the encoded signals of the last bake.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "common/bands.h"
#include "common/result.h"

namespace clamor {

struct Signal;

struct EncodedSignal {
  float scale = 1;
  std::vector<std::vector<std::byte>> blocks;
  std::vector<std::byte> envelope;
  Bands mean_square{};
};

// Encodes a signal on the caller's team. The error names the signal.
Result<EncodedSignal> encode_signal(const Signal& signal);

class SignalCache {
 public:
  // Returns the signals encoded, in their order. Signals of the last call are not encoded again;
  // signals of earlier calls are forgotten. Fails as encode_signal() does.
  Result<std::vector<std::shared_ptr<const EncodedSignal>>> encode(
      const std::vector<Signal>& signals);

 private:
  std::unordered_map<std::uint64_t, std::shared_ptr<const EncodedSignal>> encoded_;  // by hash
};

}  // namespace clamor
