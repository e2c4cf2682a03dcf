// audio_output.h: interfaces of audio outputs and of the drivers that open them.
//
// An AudioOutput is a sound device or a silent clock. A driver's outputs do not recover from
// errors; SupervisedOutput (supervised_output.h) reopens them and keeps time without them.
//
// Threads: the callback runs on a thread that the output owns, from start() to stop().
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

// Fills one block of `frames` interleaved frames at `output`. `underflow` reports that the device
// ran dry before this block. A plain function pointer, so that a call never allocates.
struct OutputCallback {
  void (*fill)(void* context, float* output, std::uint32_t frames, bool underflow) noexcept;
  void* context;
};

class AudioOutput {
 public:
  virtual ~AudioOutput() = default;  // stops

  virtual Result<void> start() = 0;
  virtual void stop() = 0;  // returns after the last callback has returned

  virtual std::string name() const = 0;
  virtual int block_frames() const = 0;  // the newest known; a device may change it at any time
  virtual int rate_hz() const = 0;

  // Why the device plays no more, in its own words, or an empty string. A device may also fall
  // silent without a report. Any thread.
  virtual std::string failure() const { return ""; }

  // Latency from here to the loudspeaker as the device or its server reports it; 0 if unknown. Any
  // thread.
  virtual double latency_s() const { return 0; }
};

inline constexpr unsigned kMinChannels = 2;  // of a device; those with fewer are not listed

struct OutputDevice {
  std::string api;   // "pulse", "jack", "alsa", "wasapi"
  std::string name;  // as the API calls it; the second of two equal names ends in " #2"
  int output_channels = 0;
  std::vector<unsigned> rates_hz;
  bool is_default = false;  // of its API

  std::string full_name() const { return api + ": " + name; }
};

struct OutputRequest {
  std::string device;  // as choose_device() takes it (device_selection.h)
  int channels = 2;
  int block_frames = 256;  // a request; the device may use another
  int rate_hz = 0;         // 0: 48 kHz, or else the device's preferred rate
  // Lets the buffer grow beyond four blocks after repeated underflows (PulseAudio only,
  // buffer_growth.h).
  bool buffer_may_grow = false;
};

// Finds and opens devices. A call may take long, or hang if a sound server hangs. Calls must not
// overlap.
class OutputDriver {
 public:
  virtual ~OutputDriver() = default;

  // All devices with two output channels or more, of one API or, if `api` is empty, of every API.
  virtual std::vector<OutputDevice> devices(const std::string& api) = 0;

  virtual Result<std::unique_ptr<AudioOutput>> open(const OutputDevice& device,
                                                    const OutputRequest& request,
                                                    OutputCallback callback) = 0;
};

// The driver for PulseAudio, JACK and ALSA, or for WASAPI.
std::shared_ptr<OutputDriver> sound_devices();

// An output that calls back in real time and discards the sound.
std::unique_ptr<AudioOutput> silent_output(int channels, int block_frames, OutputCallback callback);

}  // namespace clamor
