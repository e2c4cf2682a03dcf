// bake_layout.h: the fixed first bytes of a bake file, and how bytes are summed and packed.
//
// Shared by the writer and the reader, and by nobody else.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"

namespace clamor {

static_assert(std::endian::native == std::endian::little, "bake files are little-endian");

inline constexpr std::array<char, 8> kMagic = {'C', 'L', 'A', 'M', 'O', 'R', '\r', '\n'};

// The first 64 bytes.
struct Preamble {
  std::array<char, 8> magic = kMagic;
  std::uint16_t major = 0, minor = 0;
  std::uint32_t reserved = 0;
  std::uint64_t file_bytes = 0;
  std::uint64_t root_offset = 0, root_bytes = 0, root_hash = 0;
  std::uint64_t reserved_too = 0;
  std::uint64_t preamble_hash = 0;  // of the 56 bytes before it
};
static_assert(sizeof(Preamble) == 64);

inline constexpr std::size_t kHashedPreambleBytes = 56;

// xxHash3, 64 bits.
std::uint64_t hash_of(std::span<const std::byte> bytes);

// One zstd frame; a function of the bytes alone.
std::vector<std::byte> packed(std::span<const std::byte> bytes);

// The same for bytes that are packed to the bit already: quick to unpack, as what does not repeat
// is only copied.
std::vector<std::byte> zstd_compress_fast(std::span<const std::byte> bytes);

// "zstd 1.5.4".
std::string zstd_version();

// Exactly `size` bytes out of one frame. Allocates them and no more, whatever the frame claims.
Result<std::vector<std::byte>> unpacked(std::span<const std::byte> frame, std::size_t size);

// Unpacks frame after frame without allocating. Threads: one at a time.
class ZstdDecompressor {
 public:
  ZstdDecompressor();
  ZstdDecompressor(ZstdDecompressor&&) noexcept;
  ZstdDecompressor& operator=(ZstdDecompressor&&) noexcept;
  ~ZstdDecompressor();

  // One frame into `room`; returns how many bytes it took. A frame that says it needs more, or does
  // not say, is refused before it is touched.
  Result<std::size_t> unpack(std::span<const std::byte> frame, std::span<std::byte> room);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clamor
