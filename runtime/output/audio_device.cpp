// audio_device.cpp: lists and opens the devices of all APIs. ALSA, or WASAPI on Windows, is reached
// through RtAudio 5 or 6, which is visible only here; PulseAudio and JACK have their own files,
// which a build without CLAMOR_HAS_SOUND_SERVERS lacks.
//
// RtAudio 5 throws and numbers devices from 0; RtAudio 6 returns error codes and uses opaque ids.
// showWarnings(false) keeps warnings from standard error, and in RtAudio 6 from the error callback
// too. The UNSPECIFIED API is never used: it takes whichever it finds first.
//
// RtAudio 5.2.0 misbehaves when a sound server behind ALSA dies. Every write then fails at once, so
// callbacks come as fast as they can, each with a warning to the error callback. Stopping throws on
// whichever thread it runs, and closing waits for the callback thread, which a hanging server holds
// for ever. A failed device is therefore not stopped but only closed, on a thread that may hang
// (output_stream.h).
#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include <RtAudio.h>

#include "common/platform/process.h"
#include "runtime/output/audio_output.h"
#include "runtime/output/audio_thread.h"
#include "runtime/output/device_selection.h"
#include "runtime/output/jack_output.h"
#include "runtime/output/pulse_output.h"

namespace clamor {

namespace {

constexpr unsigned kBuffers = 4;
constexpr auto kAfterError = std::chrono::milliseconds(5);

#ifdef CLAMOR_HAS_SOUND_SERVERS
constexpr RtAudio::Api kApi = RtAudio::LINUX_ALSA;
constexpr const char* kApiName = "alsa";
constexpr bool kBackBeforeCentre = true;
#else
constexpr RtAudio::Api kApi = RtAudio::WINDOWS_WASAPI;
constexpr const char* kApiName = "wasapi";
constexpr bool kBackBeforeCentre = false;
#endif

// Silences ALSA, which reports every card that it does not find to standard error. libasound is a
// dependency of RtAudio and not ours, so its function is looked up by name.
void ignore_alsa(const char*, int, const char*, int, const char*, ...) {}

void silence_alsa() {
  if (void* const set = symbol_in(nullptr, "snd_lib_error_set_handler"))
    reinterpret_cast<int (*)(decltype(&ignore_alsa))>(set)(ignore_alsa);
}

std::vector<unsigned> ids_of(RtAudio& audio) {
#ifdef RTAUDIO_VERSION_MAJOR
  return audio.getDeviceIds();
#else
  std::vector<unsigned> ids(audio.getDeviceCount());
  for (unsigned i = 0; i < ids.size(); ++i) ids[i] = i;
  return ids;
#endif
}

std::unique_ptr<RtAudio> quiet_audio() {
  silence_alsa();
  auto audio = std::make_unique<RtAudio>(kApi);
  audio->showWarnings(false);
  return audio;
}

struct Found {
  OutputDevice device;
  unsigned id;
};

std::vector<Found> find_devices() {
  std::vector<Found> found;
  try {
    const auto audio = quiet_audio();
    if (audio->getCurrentApi() != kApi) return {};  // not compiled in
    for (const unsigned id : ids_of(*audio)) {
      const auto info = audio->getDeviceInfo(id);
      if (info.outputChannels < kMinChannels) continue;
      const auto alike = std::count_if(found.begin(), found.end(), [&](const Found& other) {
        return other.device.name.starts_with(info.name);
      });
      const std::string number = alike == 0 ? "" : " #" + std::to_string(alike + 1);
      found.push_back({{kApiName, info.name + number, static_cast<int>(info.outputChannels),
                        info.sampleRates, info.isDefaultOutput},
                       id});
    }
  } catch (const std::exception&) {
    return found;  // a device that cannot be queried cannot be used
  }
  return found;
}

class DeviceOutput final : public AudioOutput {
 public:
  DeviceOutput(std::string name, OutputCallback callback)
      : callback_(callback), name_(std::move(name)), audio_(quiet_audio()) {}

  ~DeviceOutput() override {
    stop();
    attempt([&] {
      if (audio_->isStreamOpen()) audio_->closeStream();
    });
  }

  // Opens the device. Returns the problem, or an empty string.
  std::string open(unsigned id, const OutputRequest& request, int rate_hz) {
    RtAudio::StreamParameters parameters;
    parameters.deviceId = id;
    parameters.nChannels = channels_ = static_cast<unsigned>(request.channels);
    RtAudio::StreamOptions options;
    options.numberOfBuffers = kBuffers;
    options.streamName = "clamor";
    frames_ = static_cast<unsigned>(request.block_frames);
    rate_hz_ = rate_hz;
    return attempt([&] {
#ifdef RTAUDIO_VERSION_MAJOR
      audio_->setErrorCallback(
          [this](RtAudioErrorType, const std::string& text) { on_error(text); });
      audio_->openStream(&parameters, nullptr, RTAUDIO_FLOAT32, static_cast<unsigned>(rate_hz),
                         &frames_, &DeviceOutput::on_block, this, &options);
      audio_->showWarnings(true);  // failed writes are warnings; on_error() prints none
#else
      audio_->openStream(&parameters, nullptr, RTAUDIO_FLOAT32, static_cast<unsigned>(rate_hz),
                         &frames_, &DeviceOutput::on_block, this, &options,
                         [](RtAudioError::Type, const std::string& text) {
                           if (calling_ != nullptr) calling_->on_error(text);
                         });
#endif
      if (!audio_->isStreamOpen() && problem_.empty()) problem_ = "it does not open";
    });
  }

  Result<void> start() override {
    const std::string problem = attempt([&] { audio_->startStream(); });
    if (problem.empty()) return {};
    return device_error(name_, "does not start (" + problem + ")");
  }

  void stop() override {
    if (failed_.load(std::memory_order_acquire)) return;
    attempt([&] {
      if (audio_->isStreamRunning()) audio_->stopStream();
    });
  }

  std::string name() const override { return name_; }
  int block_frames() const override { return static_cast<int>(frames_); }
  int rate_hz() const override { return rate_hz_; }

  std::string failure() const override {
    return failed_.load(std::memory_order_acquire) ? failure_ : "";
  }

 private:
  static int on_block(void* output, void*, unsigned frames, double, RtAudioStreamStatus status,
                      void* self) {
    auto& device = *static_cast<DeviceOutput*>(self);
    if (!device.begun_) {
      device.begun_ = true;
      calling_ = &device;
      begin_audio_thread();
    }
    const auto& callback = device.callback_;
    callback.fill(callback.context, static_cast<float*>(output), frames,
                  (status & RTAUDIO_OUTPUT_UNDERFLOW) != 0);
    device.order_channels(static_cast<float*>(output), frames);
    return 0;
  }

  // Channels come in the order of WAV files. ALSA has the loudspeakers at the back of 5.1 and 7.1
  // before the centre and the low frequencies.
  void order_channels(float* output, unsigned frames) const {
    if (!kBackBeforeCentre || (channels_ != 6 && channels_ != 8)) return;
    for (float* frame = output; frame != output + frames * channels_; frame += channels_)
      std::rotate(frame + 2, frame + 4, frame + 6);
  }

  // On our thread: records the problem. On the device's thread: marks the device as failed, unless
  // it only ran dry, and sleeps, so that a broken device does not call back in a busy loop at
  // real-time priority.
  void on_error(const std::string& text) {
    if (attempting_) {
      problem_ = text;
      return;
    }
    if (text.find("underrun") != std::string::npos || text.find("underflow") != std::string::npos)
      return;
    if (!failed_.load(std::memory_order_relaxed)) {
      failure_ = text;
      failed_.store(true, std::memory_order_release);
    }
    std::this_thread::sleep_for(kAfterError);
  }

  // Runs one call of either RtAudio version. Returns the problem, or an empty string.
  template <class Call>
  std::string attempt(Call call) {
    calling_ = this;
    attempting_ = true;
    problem_.clear();
    try {
      call();
    } catch (const std::exception& exception) {
      problem_ = exception.what();
    }
    attempting_ = false;
    return problem_;
  }

  // RtAudio 5 passes no context to its error callback.
  static thread_local DeviceOutput* calling_;
  static thread_local bool attempting_;

  OutputCallback callback_;
  const std::string name_;
  unsigned frames_ = 0, channels_ = 0;
  int rate_hz_ = 0;
  bool begun_ = false;   // used by the device's thread only
  std::string problem_;  // used by the calling thread only
  std::string failure_;  // written once, before failed_
  std::atomic<bool> failed_{false};
  std::unique_ptr<RtAudio> audio_;  // destroyed first
};

thread_local DeviceOutput* DeviceOutput::calling_ = nullptr;
thread_local bool DeviceOutput::attempting_ = false;

// Opens the device through RtAudio. Null on failure, with the reason in `problem`.
std::unique_ptr<AudioOutput> open_by_rtaudio(const OutputDevice& device,
                                             const OutputRequest& request, OutputCallback callback,
                                             std::string& problem) {
  problem = "it is gone";
  for (const Found& found : find_devices()) {
    if (found.device.name != device.name) continue;
    for (const int rate_hz : rates_to_try(device, request.rate_hz)) {
      auto output = std::make_unique<DeviceOutput>(device.full_name(), callback);
      problem = output->open(found.id, request, rate_hz);
      if (problem.empty()) return output;
    }
  }
  return nullptr;
}

class SoundDevices final : public OutputDriver {
 public:
  std::vector<OutputDevice> devices(const std::string& api) override {
    std::vector<OutputDevice> devices;
#ifdef CLAMOR_HAS_SOUND_SERVERS
    if (api.empty() || api == "pulse")
      std::ranges::move(pulse_devices(), std::back_inserter(devices));
    if (api.empty() || api == "jack")
      std::ranges::move(jack_devices(), std::back_inserter(devices));
#endif
    if (api.empty() || api == kApiName)
      for (const Found& found : find_devices()) devices.push_back(found.device);
    return devices;
  }

  Result<std::unique_ptr<AudioOutput>> open(const OutputDevice& device,
                                            const OutputRequest& request,
                                            OutputCallback callback) override {
    std::string problem;
    auto open_of = open_by_rtaudio;
#ifdef CLAMOR_HAS_SOUND_SERVERS
    if (device.api == "pulse") open_of = open_pulse;
    if (device.api == "jack") open_of = open_jack;
#endif
    std::unique_ptr<AudioOutput> output = open_of(device, request, callback, problem);
    if (output != nullptr) return output;
    return device_error(device.full_name(), "cannot play " + std::to_string(request.channels) +
                                                " channels (" + problem + ")");
  }
};

}  // namespace

std::shared_ptr<OutputDriver> sound_devices() { return std::make_shared<SoundDevices>(); }

}  // namespace clamor
