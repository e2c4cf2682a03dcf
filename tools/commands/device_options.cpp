#include "tools/commands/device_options.h"

#include "formats/audio/audio_file.h"
#include "formats/audio/wav_writer.h"

namespace clamor {

void DeviceArguments::add_device_options(Arguments& parser) {
  parser.option("--device", device_,
                "pulse, jack or alsa; the beginning or a part of a name that 'clamor devices' "
                "prints; or none");
  parser.words("--device", {"pulse", "jack", "alsa", "none"});
  parser.option("--rate", rate_hz_,
                "sample rate of the device in Hz; the mix is resampled [unset: 48000 if it has "
                "that]");
  parser.option("--frames", frames_, {16, 8192},
                "frames per block; PulseAudio and ALSA buffer four blocks, JACK sets its own size "
                "[unset: 256, and PulseAudio's buffer grows, up to 0.2 s, when the device runs dry "
                "twice in 30 s]");
}

void DeviceArguments::add_recording_options(Arguments& parser) {
  parser.option(
      "--record", record_,
      "also record to this .wav or .flac file, or as WAV to a device or pipe such as "
      "/dev/stdout. The file grows while it plays: whatever ends the program, a .wav file "
      "can be played to its end, a .flac file to less than a second before");
  parser.option("--format", format_,
                "sample format of the recording: float, 32, 24 or 16 [unset: float, or 24 for "
                ".flac]");
  parser.words("--format", {"float", "32", "24", "16"});
}

Result<void> DeviceArguments::read(PlayerOptions& options) const {
  options.device = device_;
  options.device_rate_hz = rate_hz_;
  if (rate_hz_ != 0 && (rate_hz_ < 8000 || rate_hz_ > 384000))
    return Error("--rate must lie between 8000 and 384000");
  if (frames_ > 0) options.block_frames = frames_;
  options.buffer_may_grow = frames_ == 0;
  options.auralizer.block_frames = options.block_frames;
  options.record = record_;
  if (!record_.empty())
    if (const auto right = check_sound_file(record_, options.auralizer.output.channels());
        !right.ok())
      return Error("--record: " + right.error().message);
  const auto samples = sample_format(format_, record_);
  if (!samples.ok()) return Error("--format: " + samples.error().message);
  options.record_format = *samples;
  return {};
}

Result<void> read_player_options(const StrategyArguments& strategy, const MixArguments& mix,
                                 const OutputArguments& output, const DeviceArguments& device,
                                 PlayerOptions& options) {
  const auto chosen = strategy.read();
  if (!chosen.ok()) return chosen.error();
  use(*chosen, options.auralizer);
  options.auralizer.limit = true;
  if (auto read = mix.read(options.auralizer); !read.ok()) return read;
  const auto format = output.read();
  if (!format.ok()) return format.error();
  options.auralizer.output = *format;
  options.auralizer.adapt = true;
  options.auralizer.first_sounds_s = kFirstSoundsOfPlayer_s;
  return device.read(options);
}

}  // namespace clamor
