// bake_layout.h: preamble, checksums and compression of a bake file.
//
// Internal to the reader and the writer.
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
#include "common/vec.h"

namespace clamor {

static_assert(std::endian::native == std::endian::little, "bake files are little-endian");

inline constexpr std::uint16_t kFormatMajor = 3, kFormatMinor = 2;

inline constexpr std::array<char, 8> kMagic = {'C', 'L', 'A', 'M', 'O', 'R', '\r', '\n'};

// First 64 bytes of the file.
struct Preamble {
  std::array<char, 8> magic = kMagic;
  std::uint16_t major = 0, minor = 0;
  std::uint32_t reserved = 0;
  std::uint64_t file_bytes = 0;
  std::uint64_t root_offset = 0, root_bytes = 0, root_hash = 0;
  std::uint64_t origin = 0;         // of the level, see packed_origin()
  std::uint64_t preamble_hash = 0;  // of the preceding 56 bytes
};
static_assert(sizeof(Preamble) == 64);

inline constexpr std::size_t kHashedPreambleBytes = 56;

// The origin of a level (formats/level/level_origin.h), which is whole hundreds of metres: three
// numbers of 21 bits in two's complement, x lowest. It is 0 for levels near the world's origin.
std::uint64_t packed_origin(const Vec3& origin_m);
Vec3 unpacked_origin_m(std::uint64_t packed);

// 64-bit xxHash3.
std::uint64_t hash_of(std::span<const std::byte> bytes);

// Compresses into one zstd frame, a function of the bytes alone.
std::vector<std::byte> packed(std::span<const std::byte> bytes);

// Compresses data that is already packed to the bit. Fast to decompress, because only repetitions
// are encoded.
std::vector<std::byte> zstd_compress_fast(std::span<const std::byte> bytes);

// "zstd 1.5.4".
std::string zstd_version();

// Decompresses a frame of exactly `size` bytes. Allocates no more, whatever the frame claims.
Result<std::vector<std::byte>> unpacked(std::span<const std::byte> frame, std::size_t size);

// Decompresses frames without allocating. Threads: one at a time.
class ZstdDecompressor {
 public:
  ZstdDecompressor();
  ZstdDecompressor(ZstdDecompressor&&) noexcept;
  ZstdDecompressor& operator=(ZstdDecompressor&&) noexcept;
  ~ZstdDecompressor();

  // Decompresses a frame into `room` and returns its size. A frame that declares a larger size, or
  // none, is an Error before any byte is written.
  Result<std::size_t> unpack(std::span<const std::byte> frame, std::span<std::byte> room);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clamor
