// audio_output.h: where samples leave the program: a sound device, or a clock that pretends.
//
// Threads: the callback runs on a thread of the output's own, from start() to stop().
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/realtime.h"

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
  virtual int block_frames() const = 0;
};

struct OutputDevice {
  std::string api;   // "pulse", "jack", "alsa"
  std::string name;  // as the API calls it
  int output_channels = 0;
  std::vector<unsigned> rates_hz;
  bool is_default = false;  // of its API
};

// All devices with an output of two channels or more.
std::vector<OutputDevice> output_devices();

// Opens a device at 48 kHz, float, with so many channels. `device` is a part of "api: name"; empty
// takes the default of the first API that has one (PulseAudio, JACK, ALSA); "none" keeps time in
// silence. The device may give another block size than the one asked for.
Result<std::unique_ptr<AudioOutput>> open_output(const std::string& device, int channels,
                                                 int block_frames, OutputCallback callback);

// The output called "none": calls back in real time and drops what it gets.
std::unique_ptr<AudioOutput> silent_output(int channels, int block_frames, OutputCallback callback);

}  // namespace clamor
