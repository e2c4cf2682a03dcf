// resampler.h: sample rate conversion for devices that do not run at the mixer's rate.
//
// Uses the windowed sinc of libsamplerate (visible in resampler.cpp only): flat to 90 % of half the
// lower rate, with images and aliases 121 dB down. The latency is half the filter, about a
// millisecond. The library's buffers are faulted in at construction.
//
// Threads: read() on one thread. Cost: about 100 multiply-adds per sample, more below 48 kHz.
#pragma once

#include <memory>
#include <span>

#include "common/result.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class Resampler {
 public:
  // Supplies input samples in whole frames.
  struct Source {
    void (*fill)(void* context, std::span<float> interleaved) noexcept;
    void* context;
  };

  static Result<std::unique_ptr<Resampler>> create(int channels, int from_hz, int to_hz);
  ~Resampler();

  // Fills `interleaved` with whole frames at the output rate and pulls the input it needs from
  // `source`.
  void read(std::span<float> interleaved, Source source) noexcept REALTIME;

 private:
  struct State;
  explicit Resampler(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
