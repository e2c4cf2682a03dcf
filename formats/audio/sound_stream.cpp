#include "formats/audio/sound_stream.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

#include "formats/audio/flac_codec.h"
#include "formats/audio/wav_header.h"

namespace clamor {

namespace {

template <class T>
std::optional<T> number_at(std::span<const std::byte> bytes, std::size_t at) {
  static_assert(std::endian::native == std::endian::little, "WAV files are little-endian");
  if (at > bytes.size() || bytes.size() - at < sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

bool has_mark(std::span<const std::byte> bytes, std::size_t at, std::string_view mark) {
  return at <= bytes.size() && bytes.size() - at >= mark.size() &&
         std::memcmp(bytes.data() + at, mark.data(), mark.size()) == 0;
}

class WavStream final : public SoundStream {
 public:
  // Null if the file is not WAV of a known encoding. A file that ends early has the frames it has.
  static std::unique_ptr<WavStream> open(std::span<const std::byte> file) {
    const bool is_long = has_mark(file, 0, "RF64");
    if ((!is_long && !has_mark(file, 0, "RIFF")) || !has_mark(file, 8, "WAVE")) return nullptr;
    auto stream = std::make_unique<WavStream>();
    std::optional<std::uint64_t> long_bytes;
    for (std::uint64_t next = 12; next < file.size();) {
      const auto at = static_cast<std::size_t>(next);
      const auto length = number_at<std::uint32_t>(file, at + 4);
      if (!length) return nullptr;
      const auto chunk = file.subspan(at + 8, std::min<std::size_t>(*length, file.size() - at - 8));
      if (has_mark(file, at, "ds64")) {
        long_bytes = number_at<std::uint64_t>(chunk, 8);
      } else if (has_mark(file, at, "fmt ")) {
        if (!stream->take_format(chunk)) return nullptr;
      } else if (has_mark(file, at, "data")) {
        if (stream->channels == 0) return nullptr;
        std::uint64_t bytes = file.size() - at - 8;
        if (*length != kUnknownWavLength)
          bytes = std::min<std::uint64_t>(bytes, *length);
        else if (is_long && long_bytes)
          bytes = std::min(bytes, *long_bytes);
        stream->samples_ = file.subspan(at + 8, static_cast<std::size_t>(bytes));
        return stream;
      }
      next += 8 + std::uint64_t{*length} + *length % 2;  // chunks are padded to even length
    }
    return nullptr;
  }

  std::size_t read(std::span<float> interleaved) override {
    const std::size_t each = bits_ / 8, per_frame = static_cast<std::size_t>(channels);
    const std::size_t frames = std::min(interleaved.size(), samples_.size() / each) / per_frame;
    for (std::size_t i = 0; i < frames * per_frame; ++i)
      interleaved[i] = sample(samples_.subspan(i * each, each));
    samples_ = samples_.subspan(frames * per_frame * each);
    return frames;
  }

  std::string problem() const override { return ""; }

 private:
  bool take_format(std::span<const std::byte> chunk) {
    auto tag = number_at<std::uint16_t>(chunk, 0);
    const auto count = number_at<std::uint16_t>(chunk, 2);
    const auto rate = number_at<std::uint32_t>(chunk, 4);
    const auto bits = number_at<std::uint16_t>(chunk, 14);
    if (tag == kWavExtensible) tag = number_at<std::uint16_t>(chunk, 24);
    if (!tag || !count || !rate || !bits || *count == 0 || *rate > 0x7fffffff) return false;
    bits_ = *bits;
    is_float_ = *tag == kWavFloat;
    if (is_float_ ? bits_ != 32 && bits_ != 64
                  : *tag != kWavPcm || bits_ % 8 != 0 || bits_ == 0 || bits_ > 32)
      return false;
    channels = *count;
    rate_hz = static_cast<int>(*rate);
    return true;
  }

  float sample(std::span<const std::byte> bytes) const {
    if (is_float_)
      return bits_ == 32 ? *number_at<float>(bytes, 0)
                         : static_cast<float>(*number_at<double>(bytes, 0));
    std::uint32_t left_aligned = 0;
    std::memcpy(reinterpret_cast<std::byte*>(&left_aligned) + 4 - bytes.size(), bytes.data(),
                bytes.size());
    if (bits_ == 8) left_aligned ^= 0x80000000;  // eight bits have no sign
    return static_cast<float>(static_cast<std::int32_t>(left_aligned)) / 2147483648.0f;
  }

  std::span<const std::byte> samples_;
  std::size_t bits_ = 0;
  bool is_float_ = false;
};

class FlacStream final : public SoundStream {
 public:
  explicit FlacStream(std::unique_ptr<FlacDecoder> decoder) : decoder_(std::move(decoder)) {
    channels = decoder_->channels();
    rate_hz = decoder_->rate_hz();
  }
  std::size_t read(std::span<float> interleaved) override { return decoder_->read(interleaved); }
  std::string problem() const override { return decoder_->problem(); }

 private:
  std::unique_ptr<FlacDecoder> decoder_;
};

}  // namespace

Result<std::unique_ptr<SoundStream>> open_wav_or_flac(std::span<const std::byte> file) {
  if (std::unique_ptr<SoundStream> wav = WavStream::open(file)) return wav;
  if (auto flac = FlacDecoder::open(file))
    return std::unique_ptr<SoundStream>(std::make_unique<FlacStream>(std::move(flac)));
  return Error("is no sound file that can be read; give WAV or FLAC.");
}

#ifndef CLAMOR_HAS_SNDFILE
Result<std::unique_ptr<SoundStream>> open_sound(std::span<const std::byte> file) {
  return open_wav_or_flac(file);
}
#endif

}  // namespace clamor
