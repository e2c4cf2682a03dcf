// audio_output.h: where samples leave the program: a sound device, or a clock that pretends.
//
// Whatever plays is an AudioOutput. Those of a driver are plain: they work until they do not. What
// keeps them going, and keeps time without them, is in supervised_output.h.
//
// Threads: the callback runs on a thread of the output's own, from start() to stop().
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

// What fills each block: `frames` interleaved frames at `output`. `underflow` tells that the
// device ran dry before it. A plain function, so that calling it allocates nothing.
struct OutputCallback {
  void (*fill)(void* context, float* output, std::uint32_t frames, bool underflow) noexcept;
  void* context;
};

class AudioOutput {
 public:
  virtual ~AudioOutput() = default;  // stops

  virtual Result<void> start() = 0;
  virtual void stop() = 0;  // returns when the callback has returned for the last time

  virtual std::string name() const = 0;
  virtual int block_frames() const = 0;  // as last heard of; a device may change it at any time
  virtual int rate_hz() const = 0;

  // Why it will play no more, as the device said itself; empty as long as it said nothing. On any
  // thread. A device may also fall silent without a word.
  virtual std::string failure() const { return ""; }

  // How long a sample that is given to the device now takes to the loudspeaker, as the device or
  // its server says; 0 where that is not known. On any thread.
  virtual double latency_s() const { return 0; }
};

inline constexpr unsigned kMinChannels = 2;  // of a device; those with fewer are not listed

struct OutputDevice {
  std::string api;   // "pulse", "jack", "alsa"
  std::string name;  // as the API calls it; the second of two with one name ends in " #2"
  int output_channels = 0;
  std::vector<unsigned> rates_hz;
  bool is_default = false;  // of its API

  std::string full_name() const { return api + ": " + name; }
};

struct OutputRequest {
  std::string device;  // as choose_device() takes it (device_selection.h)
  int channels = 2;
  int block_frames = 256;  // the device may give others
  int rate_hz = 0;         // 0: 48 kHz, or what the device likes best where it cannot
  // Where the device runs dry repeatedly, its buffer may become longer than four blocks
  // (PulseAudio only, buffer_growth.h).
  bool buffer_may_grow = false;
};

// Finds and opens devices. Its calls may take long, or hang with a sound server that hangs; only
// one of them is made at a time.
class OutputDriver {
 public:
  virtual ~OutputDriver() = default;

  // All that have an output of two channels or more, of one API or, where it is empty, of each.
  virtual std::vector<OutputDevice> devices(const std::string& api) = 0;

  virtual Result<std::unique_ptr<AudioOutput>> open(const OutputDevice& device,
                                                    const OutputRequest& request,
                                                    OutputCallback callback) = 0;
};

// PulseAudio, JACK and ALSA.
std::shared_ptr<OutputDriver> sound_devices();

// Calls back in real time and drops what it gets.
std::unique_ptr<AudioOutput> silent_output(int channels, int block_frames, OutputCallback callback);

}  // namespace clamor
