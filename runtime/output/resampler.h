// resampler.h: sound at another rate, for devices that do not run at the mixer's.
//
// A windowed sinc by Erik de Castro Lopo's libsamplerate (visible in resampler.cpp only): flat to
// 90 % of half the lower rate, images and aliases 121 dB down. What is read is late by half the
// filter's length, about a millisecond. The library's own buffers are touched beforehand.
//
// Threads: one reads. Costs about 100 multiply-adds per sample, more below 48 kHz.
#pragma once

#include <memory>
#include <span>

#include "common/result.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class Resampler {
 public:
  // Where samples come from: fills whole frames.
  struct Source {
    void (*fill)(void* context, std::span<float> interleaved) noexcept;
    void* context;
  };

  static Result<std::unique_ptr<Resampler>> create(int channels, int from_hz, int to_hz);
  ~Resampler();

  // Fills `interleaved`, whole frames at the new rate, and asks `source` for as many as that takes.
  void read(std::span<float> interleaved, Source source) noexcept REALTIME;

 private:
  struct State;
  explicit Resampler(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
