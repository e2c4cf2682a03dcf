// sndfile_stream.cpp: reads all formats of libsndfile. Builds without CLAMOR_WITH_SNDFILE lack it.
#include <algorithm>
#include <cstring>
#include <string_view>

#include <fmt/format.h>
#include <sndfile.h>

#include "formats/audio/sound_stream.h"

namespace clamor {

namespace {

// A file in memory for libsndfile's virtual I/O.
struct Memory {
  std::span<const std::byte> file;
  sf_count_t position = 0;

  sf_count_t size() const { return static_cast<sf_count_t>(file.size()); }
};

sf_count_t memory_length(void* user) { return static_cast<Memory*>(user)->size(); }
sf_count_t memory_tell(void* user) { return static_cast<Memory*>(user)->position; }
sf_count_t memory_seek(sf_count_t offset, int whence, void* user) {
  auto& memory = *static_cast<Memory*>(user);
  const sf_count_t base = whence == SEEK_SET   ? 0
                          : whence == SEEK_CUR ? memory.position
                                               : memory.size();
  memory.position = std::clamp<sf_count_t>(base + offset, 0, memory.size());
  return memory.position;
}
sf_count_t memory_read(void* to, sf_count_t count, void* user) {
  auto& memory = *static_cast<Memory*>(user);
  count = std::clamp<sf_count_t>(count, 0, memory.size() - memory.position);
  if (count == 0) return 0;
  std::memcpy(to, memory.file.data() + memory.position, static_cast<std::size_t>(count));
  memory.position += count;
  return count;
}
sf_count_t memory_write(const void*, sf_count_t, void*) { return 0; }

// Bits of each sample of a FLAC file, by its STREAMINFO (RFC 9639, section 8.2); 0 of other files.
unsigned flac_bits(std::span<const std::byte> file) {
  constexpr std::string_view kMagic = "fLaC";
  if (file.size() < 22 || std::memcmp(file.data(), kMagic.data(), kMagic.size()) != 0) return 0;
  const auto byte = [&](std::size_t at) { return std::to_integer<unsigned>(file[at]); };
  return ((byte(20) & 1) << 4 | byte(21) >> 4) + 1;
}

class SndfileStream final : public SoundStream {
 public:
  explicit SndfileStream(std::span<const std::byte> file) : memory_{file} {
    SF_VIRTUAL_IO io = {memory_length, memory_seek, memory_read, memory_write, memory_tell};
    SF_INFO info{};
    sound_ = sf_open_virtual(&io, SFM_READ, &info, &memory_);
    channels = info.channels;
    rate_hz = info.samplerate;
  }
  ~SndfileStream() override {
    if (sound_ != nullptr) sf_close(sound_);
  }
  SndfileStream(const SndfileStream&) = delete;
  SndfileStream& operator=(const SndfileStream&) = delete;

  bool is_open() const { return sound_ != nullptr; }

  std::size_t read(std::span<float> interleaved) override {
    const auto frames = static_cast<sf_count_t>(interleaved.size()) / channels;
    return static_cast<std::size_t>(
        std::max<sf_count_t>(sf_readf_float(sound_, interleaved.data(), frames), 0));
  }
  std::string problem() const override {
    return sf_error(sound_) == SF_ERR_NO_ERROR ? "" : sf_strerror(sound_);
  }

 private:
  Memory memory_;
  SNDFILE* sound_ = nullptr;
};

}  // namespace

Result<std::unique_ptr<SoundStream>> open_sound(std::span<const std::byte> file) {
  auto stream = std::make_unique<SndfileStream>(file);
  if (stream->is_open()) return std::unique_ptr<SoundStream>(std::move(stream));
  if (const unsigned bits = flac_bits(file); bits % 8 != 0 || bits > 24)
    return Error(fmt::format(
        "is FLAC of {} bits, and libsndfile reads 8, 16 and 24; make it a WAV file, as by "
        "'flac -d'.",
        bits));
  return Error(fmt::format("is no sound file that can be read ({}); give WAV, FLAC, Ogg or MP3.",
                           sf_strerror(nullptr)));
}

}  // namespace clamor
