// flac_codec.h: encodes and decodes FLAC streams (RFC 9639) with libFLAC, which is visible in
// flac_codec.cpp only.
//
// Threads: each object on one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/result.h"

namespace clamor {

// Writes one FLAC stream, which its end changes at its beginning: lengths and a checksum.
class FlacEncoder {
 public:
  // Stores bytes at an offset that follows what was written before or lies in it; false if it
  // fails.
  using Store = std::function<bool(std::uint64_t offset, std::span<const std::byte> bytes)>;

  // Null if libFLAC refuses the format or memory is exhausted.
  static std::unique_ptr<FlacEncoder> create(int channels, int rate_hz, int bits, Store store);
  ~FlacEncoder();

  // Samples of `bits` bits. Returns whether all could be stored.
  bool write(std::span<const std::int32_t> interleaved);
  bool finish();

 private:
  struct State;
  explicit FlacEncoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

// Reads one FLAC stream in memory, which must outlive it.
class FlacDecoder {
 public:
  // Null if there is no FLAC stream, or its first block does not describe it.
  static std::unique_ptr<FlacDecoder> open(std::span<const std::byte> file);
  ~FlacDecoder();

  int channels() const;
  int rate_hz() const;

  // Fills whole frames, full scale being +-1. Returns fewer than asked for, or 0, at the end.
  std::size_t read(std::span<float> interleaved);
  // Why the stream ended early, or "".
  const std::string& problem() const;

 private:
  struct State;
  explicit FlacDecoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

std::string flac_version();  // "libFLAC 1.4.2"

}  // namespace clamor
