#include "formats/audio/audio_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <soxr.h>

#include "common/memory_size.h"
#include "common/sample_rate.h"
#include "formats/audio/flac_codec.h"
#include "formats/audio/sound_stream.h"
#include "formats/files/file_kind.h"
#include "formats/files/level_folder.h"

namespace clamor {

namespace {

constexpr float kLoudest = 1e6f;  // 120 dB over full scale: not audio data

constexpr float kSilent = 1e-4f;     // 80 dB below full scale
constexpr double kCancelled_db = 6;  // unrelated channels lose 3 dB for two of them

constexpr double kLongest_s = 30 * 60;
constexpr int kMaxChannels = 64;
constexpr std::size_t kBlockFrames = 4096;

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

// Decode all channels, or only their mean.
enum class Channels { kApart, kMean };

Result<Sound> decode(std::span<const std::byte> file, const std::string& name, Channels wanted,
                     int max_channels) {
  const auto refused = [&](const std::string& why) { return Error(name + ": " + why); };
  if (const std::string other = other_kind(file, FileKind::kSound); !other.empty())
    return refused(other + ".");
  const auto opened = open_sound(file);
  if (!opened.ok()) return refused(opened.error().message);
  SoundStream& sound = **opened;
  if (sound.channels < 1 || sound.channels > max_channels || sound.rate_hz < kMinSoundRate_hz ||
      sound.rate_hz > kMaxSoundRate_hz)
    return refused(fmt::format(
        "has {} channels at {} Hz; at most {} channels at {} to {} Hz are "
        "read.",
        sound.channels, sound.rate_hz, max_channels, kMinSoundRate_hz, kMaxSoundRate_hz));

  const auto channels = static_cast<std::size_t>(sound.channels);
  Sound result{std::vector<std::vector<float>>(wanted == Channels::kMean ? 1 : channels),
               sound.rate_hz,
               {.channels = sound.channels}};
  std::vector<std::unique_ptr<Resampler>> resamplers;
  for (std::size_t c = 0; c < result.channels.size(); ++c)
    resamplers.push_back(std::make_unique<Resampler>(sound.rate_hz));
  std::vector<float> block(kBlockFrames * channels);
  std::vector<float> mono;
  double length_s = 0, mean_power = 0, channel_power = 0;
  for (;;) {
    const std::size_t frames = sound.read(block);
    if (frames == 0) break;
    length_s += static_cast<double>(frames) / sound.rate_hz;
    if (length_s > kLongest_s)
      return refused("is longer than 30 minutes, the most that is read; cut it.");
    mono.assign(frames, 0);
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
  if (const std::string problem = sound.problem(); !problem.empty())
    return refused(fmt::format("is damaged ({}); export it again.", problem));
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
  const auto stream = FlacDecoder::open(flac);
  if (stream == nullptr) return Error("is no FLAC stream");
  if (stream->channels() != 1 || stream->rate_hz() != kSampleRate_hz)
    return Error("is no FLAC stream of one channel at 48 kHz");
  std::vector<float> samples(memory_size(max_frames + 1));
  samples.resize(stream->read(samples));
  if (!stream->problem().empty()) return Error(fmt::format("is damaged ({})", stream->problem()));
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
  const auto encoder = FlacEncoder::create(
      1, kSampleRate_hz, 24, [&](std::uint64_t offset, std::span<const std::byte> bytes) {
        file.resize(std::max(file.size(), memory_size(offset + bytes.size())));
        std::copy(bytes.begin(), bytes.end(), file.begin() + static_cast<std::ptrdiff_t>(offset));
        return true;
      });
  constexpr float kFullScale = 1 << 23;
  std::vector<std::int32_t> whole(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    whole[i] = static_cast<std::int32_t>(
        std::min(std::nearbyint(samples[i] * kFullScale), kFullScale - 1));
  if (encoder == nullptr || !encoder->write(whole) || !encoder->finish())
    return Error("a sound cannot be encoded as FLAC.");
  return file;
}

std::vector<std::string> sound_library_versions() {
  std::string soxr = soxr_version();  // "libsoxr-0.1.3"
  std::replace(soxr.begin(), soxr.end(), '-', ' ');
  return {flac_version(), soxr};
}

}  // namespace clamor
