// audio_device.cpp: sound devices through RtAudio 5 or 6, which is visible only here.
//
// Version 5 throws and numbers devices from 0; version 6 returns codes and has opaque numbers.
// Never the UNSPECIFIED API, which takes whichever it finds first.
#include <algorithm>
#include <array>
#include <cctype>

#include <RtAudio.h>
#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include "formats/level.h"
#include "runtime/audio_output.h"

namespace clamor {

namespace {

constexpr int kChannels = 2;
constexpr int kPriority = 20;     // among real-time threads, below the kernel's own
constexpr unsigned kBuffers = 4;  // 0 would mean two seconds on PulseAudio

struct Api {
  RtAudio::Api api;
  const char* name;
};
constexpr std::array<Api, 3> kApis = {
    {{RtAudio::LINUX_PULSE, "pulse"}, {RtAudio::UNIX_JACK, "jack"}, {RtAudio::LINUX_ALSA, "alsa"}}};

// The sound libraries complain to standard error about every card they do not find.
class QuietErrors {
 public:
  QuietErrors() : saved_(::dup(STDERR_FILENO)) {
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nowhere < 0) return;
    ::dup2(nowhere, STDERR_FILENO);
    ::close(nowhere);
  }
  ~QuietErrors() {
    if (saved_ < 0) return;
    ::dup2(saved_, STDERR_FILENO);
    ::close(saved_);
  }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;

 private:
  int saved_;
};

struct Found {
  OutputDevice device;
  RtAudio::Api api;
  unsigned id;
};

std::vector<unsigned> ids_of(RtAudio& audio) {
#ifdef RTAUDIO_VERSION_MAJOR
  return audio.getDeviceIds();
#else
  std::vector<unsigned> ids(audio.getDeviceCount());
  for (unsigned i = 0; i < ids.size(); ++i) ids[i] = i;
  return ids;
#endif
}

std::unique_ptr<RtAudio> quiet_audio(RtAudio::Api api) {
  auto audio = std::make_unique<RtAudio>(api);
  audio->showWarnings(false);
  return audio;
}

std::vector<Found> find_devices() {
  const QuietErrors quiet;
  std::vector<Found> found;
  for (const Api& api : kApis) {
    try {
      const auto audio = quiet_audio(api.api);
      if (audio->getCurrentApi() != api.api) continue;  // not compiled in
      for (const unsigned id : ids_of(*audio)) {
        const auto info = audio->getDeviceInfo(id);
        if (info.outputChannels < kChannels) continue;
        found.push_back({{api.name, info.name, static_cast<int>(info.outputChannels),
                          info.sampleRates, info.isDefaultOutput},
                         api.api,
                         id});
      }
    } catch (const std::exception&) {
      continue;  // a device that cannot be asked cannot be used
    }
  }
  return found;
}

std::string full_name(const OutputDevice& device) { return device.api + ": " + device.name; }

class DeviceOutput final : public AudioOutput {
 public:
  DeviceOutput(const Found& found, int channels, int block_frames, OutputCallback callback)
      : callback_(callback),
        channels_(channels),
        name_(full_name(found.device)),
        frames_(static_cast<unsigned>(block_frames)),
        audio_(quiet_audio(found.api)) {
    RtAudio::StreamParameters parameters;
    parameters.deviceId = found.id;
    parameters.nChannels = static_cast<unsigned>(channels);
    RtAudio::StreamOptions options;
    options.numberOfBuffers = kBuffers;
    options.streamName = "clamor";
    attempt([&] {
      return audio_->openStream(&parameters, nullptr, RTAUDIO_FLOAT32, kSampleRate_hz, &frames_,
                                &DeviceOutput::on_block, this, &options);
    });
  }

  ~DeviceOutput() override {
    stop();
    const QuietErrors quiet;
    if (audio_->isStreamOpen()) audio_->closeStream();
  }

  Result<void> start() override {
    attempt([&] { return audio_->startStream(); });
    return status();
  }

  void stop() override {
    const QuietErrors quiet;
    if (audio_->isStreamRunning()) attempt([&] { return audio_->stopStream(); });
  }

  std::string name() const override { return name_; }
  int block_frames() const override { return static_cast<int>(frames_); }

  Result<void> status() const {
    if (problem_.empty()) return {};
    return Error("the sound device " + in_quotes(name_) + " cannot play " +
                 std::to_string(channels_) + " channels at 48 kHz (" + problem_ +
                 "); name another of 'clamor devices' with --device");
  }

 private:
  static int on_block(void* output, void*, unsigned frames, double, RtAudioStreamStatus status,
                      void* self) {
    auto& device = *static_cast<DeviceOutput*>(self);
    if (!device.prioritised_) {
      // RtAudio would do this too, but prints a line about it. Where it is not allowed, so be it.
      device.prioritised_ = true;
      const sched_param priority{kPriority};
      ::pthread_setschedparam(::pthread_self(), SCHED_RR, &priority);
    }
    const auto& callback = device.callback_;
    callback.fill(callback.context, static_cast<float*>(output), frames,
                  (status & RTAUDIO_OUTPUT_UNDERFLOW) != 0);
    return 0;
  }

  // Runs one call of either version and keeps what went wrong.
  template <class Call>
  void attempt(Call call) {
    const QuietErrors quiet;
    try {
#ifdef RTAUDIO_VERSION_MAJOR
      if (call() != RTAUDIO_NO_ERROR) problem_ = audio_->getErrorText();
#else
      call();
#endif
    } catch (const std::exception& exception) {
      problem_ = exception.what();
    }
  }

  OutputCallback callback_;
  int channels_;
  bool prioritised_ = false;  // the audio thread's alone
  std::string name_;
  unsigned frames_;
  std::string problem_;
  std::unique_ptr<RtAudio> audio_;
};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

std::vector<OutputDevice> output_devices() {
  std::vector<OutputDevice> devices;
  for (const Found& found : find_devices()) devices.push_back(found.device);
  return devices;
}

Result<std::unique_ptr<AudioOutput>> open_output(const std::string& device, int channels,
                                                 int block_frames, OutputCallback callback) {
  if (device == "none") return silent_output(channels, block_frames, callback);
  const auto found = find_devices();
  if (found.empty())
    return Error(
        "there is no sound device; start a sound server, use --device none to play in silence, or "
        "'clamor render' to write a WAV file");
  auto chosen = std::find_if(found.begin(), found.end(), [&](const Found& candidate) {
    return device.empty()
               ? candidate.device.is_default
               : lower(full_name(candidate.device)).find(lower(device)) != std::string::npos;
  });
  if (chosen == found.end() && device.empty()) chosen = found.begin();
  if (chosen == found.end())
    return Error("no sound device is called " + in_quotes(device) +
                 "; 'clamor devices' lists them, the first is " +
                 in_quotes(full_name(found.front().device)));
  auto output = std::make_unique<DeviceOutput>(*chosen, channels, block_frames, callback);
  if (const auto opened = output->status(); !opened.ok()) return opened.error();
  return std::unique_ptr<AudioOutput>(std::move(output));
}

}  // namespace clamor
