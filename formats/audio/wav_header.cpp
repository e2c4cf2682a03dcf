#include "formats/audio/wav_header.h"

#include <array>
#include <bit>
#include <cassert>
#include <cstring>
#include <string_view>

namespace clamor {

namespace {

static_assert(std::endian::native == std::endian::little, "WAV files are little-endian");

constexpr std::uint32_t kDs64Bytes = 28;
// Tail of KSDATAFORMAT_SUBTYPE_PCM and _IEEE_FLOAT after their 16-bit tag.
constexpr std::array<unsigned char, 14> kSubtype = {0, 0, 0,    0, 0x10, 0,    0x80,
                                                    0, 0, 0xaa, 0, 0x38, 0x9b, 0x71};

class HeaderBytes {
 public:
  template <class T>
  void add(const T& value) {
    const std::size_t before = bytes_.size();
    bytes_.resize(before + sizeof value);
    std::memcpy(bytes_.data() + before, &value, sizeof value);
  }
  void add_name(std::string_view name) {
    for (const char c : name) bytes_.push_back(static_cast<std::byte>(c));
  }
  std::size_t size() const { return bytes_.size(); }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

void add_format(const WavShape& shape, HeaderBytes& bytes) {
  const std::uint16_t tag = shape.is_float ? kWavFloat : kWavPcm;
  const auto frame_bytes = static_cast<std::uint16_t>(shape.frame_bytes());
  bytes.add_name("fmt ");
  bytes.add(std::uint32_t{shape.channel_mask ? 40u : shape.is_float ? 18u : 16u});
  bytes.add(shape.channel_mask ? kWavExtensible : tag);
  bytes.add(static_cast<std::uint16_t>(shape.channels));
  bytes.add(static_cast<std::uint32_t>(shape.rate_hz));
  bytes.add(static_cast<std::uint32_t>(shape.rate_hz) * frame_bytes);
  bytes.add(frame_bytes);
  bytes.add(static_cast<std::uint16_t>(shape.bits));
  if (shape.channel_mask) {
    bytes.add(std::uint16_t{22});  // size of the extension
    bytes.add(static_cast<std::uint16_t>(shape.bits));
    bytes.add(*shape.channel_mask);
    bytes.add(tag);
    bytes.add(kSubtype);
  } else if (shape.is_float) {
    bytes.add(std::uint16_t{0});
  }
}

}  // namespace

std::vector<std::byte> wav_header(const WavShape& shape, std::optional<std::uint64_t> data_bytes) {
  HeaderBytes format;
  add_format(shape, format);
  const std::size_t fact_bytes = shape.is_float ? 12 : 0;
  const std::uint64_t before_samples = 4 + 8 + kDs64Bytes + format.size() + fact_bytes + 8;
  const std::uint64_t data = data_bytes.value_or(0), frames = data / shape.frame_bytes();
  const std::uint64_t riff = before_samples + data + data % 2;  // chunks are padded to even length
  const bool is_long = data_bytes && riff >= kUnknownWavLength;
  const auto length = [&](std::uint64_t value) {
    return is_long || !data_bytes ? kUnknownWavLength : static_cast<std::uint32_t>(value);
  };

  HeaderBytes bytes;
  bytes.add_name(is_long ? "RF64" : "RIFF");
  bytes.add(length(riff));
  bytes.add_name("WAVE");
  bytes.add_name(is_long ? "ds64" : "JUNK");
  bytes.add(kDs64Bytes);
  for (const std::uint64_t value : {riff, data, frames}) bytes.add(is_long ? value : 0);
  bytes.add(std::uint32_t{0});  // number of other long chunks
  add_format(shape, bytes);
  if (shape.is_float) {
    bytes.add_name("fact");
    bytes.add(std::uint32_t{4});
    bytes.add(length(frames));
  }
  bytes.add_name("data");
  bytes.add(length(data));
  assert(bytes.size() == before_samples + 8);
  return bytes.take();
}

}  // namespace clamor
