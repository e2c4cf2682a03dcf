#include "formats/audio/audio_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include <fmt/format.h>
#include <sndfile.h>
#include <soxr.h>

#include "common/sample_rate.h"
#include "formats/files/file_kind.h"
#include "formats/files/level_folder.h"

namespace clamor {

namespace {

constexpr float kLoudest = 1e6f;  // 120 dB over full scale: not audio data

constexpr float kSilent = 1e-4f;     // 80 dB below full scale
constexpr double kCancelled_db = 6;  // unrelated channels lose 3 dB for two of them

constexpr double kLongest_s = 30 * 60;
constexpr int kMaxChannels = 64;
constexpr sf_count_t kBlockFrames = 4096;

// A file in memory for libsndfile's virtual I/O.
struct Memory {
  const std::byte* read = nullptr;            // file to read,
  std::vector<std::byte>* written = nullptr;  // or destination of writes
  sf_count_t size = 0, position = 0;
};

sf_count_t memory_length(void* user) { return static_cast<Memory*>(user)->size; }
sf_count_t memory_tell(void* user) { return static_cast<Memory*>(user)->position; }
sf_count_t memory_seek(sf_count_t offset, int whence, void* user) {
  auto& memory = *static_cast<Memory*>(user);
  const sf_count_t base = whence == SEEK_SET   ? 0
                          : whence == SEEK_CUR ? memory.position
                                               : memory.size;
  memory.position = std::clamp<sf_count_t>(base + offset, 0, memory.size);
  return memory.position;
}
sf_count_t memory_read(void* to, sf_count_t count, void* user) {
  auto& memory = *static_cast<Memory*>(user);
  count = std::clamp<sf_count_t>(count, 0, memory.size - memory.position);
  if (count == 0) return 0;
  const std::byte* from = memory.read != nullptr ? memory.read : memory.written->data();
  std::memcpy(to, from + memory.position, static_cast<std::size_t>(count));
  memory.position += count;
  return count;
}
sf_count_t memory_write(const void* from, sf_count_t count, void* user) {
  auto& memory = *static_cast<Memory*>(user);
  if (memory.written == nullptr) return 0;
  memory.size = std::max(memory.size, memory.position + count);
  memory.written->resize(static_cast<std::size_t>(memory.size));
  std::memcpy(memory.written->data() + memory.position, from, static_cast<std::size_t>(count));
  memory.position += count;
  return count;
}

SF_VIRTUAL_IO memory_io() {
  return {memory_length, memory_seek, memory_read, memory_write, memory_tell};
}

struct CloseSound {
  void operator()(SNDFILE* file) const { sf_close(file); }
};
using SoundFile = std::unique_ptr<SNDFILE, CloseSound>;

// Resamples a stream to kSampleRate_hz; a stream of that rate is copied.
class Resampler {
 public:
  explicit Resampler(int rate_hz) : ratio_(static_cast<double>(kSampleRate_hz) / rate_hz) {
    if (rate_hz == kSampleRate_hz) return;
    const soxr_quality_spec_t quality = soxr_quality_spec(SOXR_VHQ, 0);
    const soxr_runtime_spec_t one_thread = soxr_runtime_spec(1);
    soxr_ = soxr_create(rate_hz, kSampleRate_hz, 1, &error_, nullptr, &quality, &one_thread);
  }
  ~Resampler() { soxr_delete(soxr_); }
  Resampler(const Resampler&) = delete;
  Resampler& operator=(const Resampler&) = delete;

  // An empty `in` flushes the end of the stream. Returns false if soxr fails.
  bool append(std::span<const float> in, std::vector<float>& out) {
    if (error_ != nullptr) return false;
    if (soxr_ == nullptr) {
      out.insert(out.end(), in.begin(), in.end());
      return true;
    }
    block_.resize(static_cast<std::size_t>(std::ceil(kBlockFrames * std::max(ratio_, 1.0))) + 16);
    for (std::size_t done = 0, made = 1; done < in.size() || (in.empty() && made > 0);) {
      std::size_t used = 0;
      error_ = soxr_process(soxr_, in.empty() ? nullptr : in.data() + done, in.size() - done, &used,
                            block_.data(), block_.size(), &made);
      if (error_ != nullptr || (used == 0 && made == 0 && !in.empty())) return false;
      out.insert(out.end(), block_.begin(), block_.begin() + static_cast<std::ptrdiff_t>(made));
      done += used;
    }
    return true;
  }

 private:
  double ratio_;
  soxr_t soxr_ = nullptr;
  soxr_error_t error_ = nullptr;
  std::vector<float> block_;
};

// Bits of each sample of a FLAC file, by its STREAMINFO (RFC 9639, section 8.2); 0 of other files.
unsigned flac_bits(std::span<const std::byte> file) {
  constexpr std::string_view kMagic = "fLaC";
  if (file.size() < 22 || std::memcmp(file.data(), kMagic.data(), kMagic.size()) != 0) return 0;
  const auto byte = [&](std::size_t at) { return std::to_integer<unsigned>(file[at]); };
  return ((byte(20) & 1) << 4 | byte(21) >> 4) + 1;
}

// Why libsndfile does not open a file, and what to do about it.
std::string why_unread(std::span<const std::byte> file) {
  const std::string other = other_kind(file, FileKind::kSound);
  if (!other.empty()) return other + ".";
  if (const unsigned bits = flac_bits(file); bits % 8 != 0 || bits > 24)
    return fmt::format(
        "is FLAC of {} bits, and libsndfile reads 8, 16 and 24; make it a WAV file, as by "
        "'flac -d'.",
        bits);
  return fmt::format("is no sound file that can be read ({}); give WAV, FLAC, Ogg or MP3.",
                     sf_strerror(nullptr));
}

// Decode all channels, or only their mean.
enum class Channels { kApart, kMean };

Result<Sound> decode(std::span<const std::byte> file, const std::string& name, Channels wanted,
                     int max_channels) {
  const auto refused = [&](const std::string& why) { return Error(name + ": " + why); };
  Memory memory{file.data(), nullptr, static_cast<sf_count_t>(file.size()), 0};
  SF_VIRTUAL_IO io = memory_io();
  SF_INFO info{};
  const SoundFile sound(sf_open_virtual(&io, SFM_READ, &info, &memory));
  if (sound == nullptr) return refused(why_unread(file));
  if (info.channels < 1 || info.channels > max_channels || info.samplerate < kMinSoundRate_hz ||
      info.samplerate > kMaxSoundRate_hz)
    return refused(fmt::format(
        "has {} channels at {} Hz; at most {} channels at {} to {} Hz are "
        "read.",
        info.channels, info.samplerate, max_channels, kMinSoundRate_hz, kMaxSoundRate_hz));

  const auto channels = static_cast<std::size_t>(info.channels);
  Sound result{std::vector<std::vector<float>>(wanted == Channels::kMean ? 1 : channels),
               info.samplerate,
               {.channels = info.channels}};
  std::vector<std::unique_ptr<Resampler>> resamplers;
  for (std::size_t c = 0; c < result.channels.size(); ++c)
    resamplers.push_back(std::make_unique<Resampler>(info.samplerate));
  std::vector<float> block(static_cast<std::size_t>(kBlockFrames) * channels);
  std::vector<float> mono;
  double length_s = 0, mean_power = 0, channel_power = 0;
  for (;;) {
    const sf_count_t frames = sf_readf_float(sound.get(), block.data(), kBlockFrames);
    if (frames <= 0) break;
    length_s += static_cast<double>(frames) / info.samplerate;
    if (length_s > kLongest_s)
      return refused("is longer than 30 minutes, the most that is read; cut it.");
    mono.assign(static_cast<std::size_t>(frames), 0);
    for (std::size_t to = 0; to < result.channels.size(); ++to) {
      const std::size_t begin = wanted == Channels::kMean ? 0 : to;
      const std::size_t end = wanted == Channels::kMean ? channels : to + 1;
      for (std::size_t i = 0; i < mono.size(); ++i) {
        double sum = 0, squares = 0;
        for (std::size_t c = begin; c < end; ++c) {
          const double sample = block[i * channels + c];
          sum += sample;
          squares += sample * sample;
        }
        const double mean = sum / static_cast<double>(end - begin);
        mono[i] = static_cast<float>(mean);
        mean_power += mean * mean;
        channel_power += squares / static_cast<double>(end - begin);
        result.downmix.peak = std::max(result.downmix.peak, std::abs(mono[i]));
        if (!std::isfinite(mono[i]))
          return refused("holds samples that are no finite numbers (NaN or infinite); repair it.");
        if (std::abs(mono[i]) > kLoudest)
          return refused("holds samples beyond a million times full scale; repair it.");
      }
      if (!resamplers[to]->append(mono, result.channels[to]))
        return refused("cannot be resampled to 48 kHz.");
    }
  }
  if (sf_error(sound.get()) != SF_ERR_NO_ERROR)
    return refused(fmt::format("is damaged ({}); export it again.", sf_strerror(sound.get())));
  for (std::size_t c = 0; length_s > 0 && c < result.channels.size(); ++c)
    if (!resamplers[c]->append({}, result.channels[c]))
      return refused("cannot be resampled to 48 kHz.");
  if (result.frames() == 0) return refused("holds no samples; export it again.");
  if (channel_power > 0)
    result.downmix.loss_db = 10 * std::log10(channel_power / std::max(mean_power, 1e-30));
  return result;
}

}  // namespace

Result<std::vector<float>> resampled(std::span<const float> samples, int rate_hz) {
  if (rate_hz < kMinSoundRate_hz || rate_hz > kMaxSoundRate_hz)
    return Error(fmt::format("has a rate of {} Hz; rates lie between {} and {} Hz", rate_hz,
                             kMinSoundRate_hz, kMaxSoundRate_hz));
  std::vector<float> made;
  Resampler resampler(rate_hz);
  if (!resampler.append(samples, made) || !resampler.append({}, made))
    return Error("cannot be resampled");
  return made;
}

Result<std::vector<float>> read_audio(const std::string& path) {
  const auto bytes = read_whole_file(path);
  if (!bytes.ok()) return bytes.error();
  return decode_audio(*bytes, path);
}

std::string Downmix::note(const std::string& name) const {
  if (channels == 1) return "";
  return fmt::format(
      "all but the mean of the {} channels of {}; an emitter is one point, so give each channel "
      "one of its own to keep them apart",
      channels, in_quotes(name));
}

std::string Downmix::warning(const std::string& name) const {
  if (loss_db > kCancelled_db)
    return fmt::format(
        "{} {} when its {} channels are averaged, because they cancel; export one of them, or "
        "invert "
        "one",
        in_quotes(name),
        peak < kSilent ? "is silent" : fmt::format("becomes {:.0f} dB quieter", loss_db), channels);
  if (peak < kSilent)
    return in_quotes(name) + " is silent: all its samples are 0, or nearly; export it again";
  return "";
}

Result<std::vector<float>> decode_audio(std::span<const std::byte> file, const std::string& name,
                                        Downmix* downmix) {
  Result<Sound> sound = decode(file, name, Channels::kMean, kMaxChannels);
  if (!sound.ok()) return sound.error();
  if (downmix != nullptr) *downmix = sound->downmix;
  return std::move(sound->channels.front());
}

Result<std::vector<float>> decode_flac(std::span<const std::byte> flac, std::uint64_t max_frames) {
  // libsndfile would accept any format.
  constexpr std::string_view kMark = "fLaC";
  if (flac.size() < kMark.size() || std::memcmp(flac.data(), kMark.data(), kMark.size()) != 0)
    return Error("is no FLAC stream");
  Memory memory{flac.data(), nullptr, static_cast<sf_count_t>(flac.size()), 0};
  SF_VIRTUAL_IO io = memory_io();
  SF_INFO info{};
  const SoundFile sound(sf_open_virtual(&io, SFM_READ, &info, &memory));
  if (sound == nullptr || (info.format & SF_FORMAT_TYPEMASK) != SF_FORMAT_FLAC ||
      info.channels != 1 || info.samplerate != kSampleRate_hz)
    return Error("is no FLAC stream of one channel at 48 kHz");
  std::vector<float> samples(max_frames + 1);
  std::size_t done = 0;
  while (done < samples.size()) {
    const sf_count_t wanted =
        std::min(kBlockFrames, static_cast<sf_count_t>(samples.size() - done));
    const sf_count_t got = sf_readf_float(sound.get(), samples.data() + done, wanted);
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
  }
  if (sf_error(sound.get()) != SF_ERR_NO_ERROR)
    return Error(fmt::format("is damaged ({})", sf_strerror(sound.get())));
  samples.resize(done);
  return samples;
}

Result<Sound> read_channels(const std::string& path, int max_channels) {
  const auto bytes = read_whole_file(path);
  if (!bytes.ok()) return bytes.error();
  return decode(*bytes, path, Channels::kApart, std::min(max_channels, kMaxChannels));
}

Result<std::vector<std::byte>> encode_flac(std::span<const float> samples) {
  if (samples.empty()) return Error("a sound without samples cannot be encoded.");
  for (const float sample : samples)
    if (!(std::fabs(sample) <= 1))
      return Error(fmt::format("a sound reaches {:g}, beyond full scale; lower it by {:.1f} dB.",
                               sample, 20 * std::log10(std::fabs(sample))));
  std::vector<std::byte> file;
  Memory memory{nullptr, &file, 0, 0};
  SF_VIRTUAL_IO io = memory_io();
  SF_INFO info{};
  info.channels = 1;
  info.samplerate = kSampleRate_hz;
  info.format = SF_FORMAT_FLAC | SF_FORMAT_PCM_24;
  SNDFILE* sound = sf_open_virtual(&io, SFM_WRITE, &info, &memory);
  if (sound == nullptr)
    return Error(
        fmt::format("a sound cannot be encoded as FLAC ({}); install libsndfile with FLAC.",
                    sf_strerror(nullptr)));
  sf_command(sound, SFC_SET_CLIPPING, nullptr, SF_TRUE);
  const auto frames = static_cast<sf_count_t>(samples.size());
  const bool written = sf_writef_float(sound, samples.data(), frames) == frames;
  if (sf_close(sound) != 0 || !written) return Error("a sound cannot be encoded as FLAC.");
  return file;
}

std::vector<std::string> sound_library_versions() {
  std::string sndfile = sf_version_string(), soxr = soxr_version();
  std::replace(sndfile.begin(), sndfile.end(), '-', ' ');
  std::replace(soxr.begin(), soxr.end(), '-', ' ');
  return {sndfile, soxr};  // each starts with the name of its library
}

}  // namespace clamor
