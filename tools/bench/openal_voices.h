// openal_voices.h: mixes voices with OpenAL Soft, if installed, through its loopback device.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace clamor {

class OpenalVoices {
 public:
  // Each voice is a source that loops one of `signals` from a start frame at a pitch, `right` to
  // the right (-1 to 1), with a gain of 1 / voices. Returns null if OpenAL Soft is missing or
  // refuses so many sources.
  struct Voice {
    std::size_t signal;
    int start_frame;
    float pitch, right;
  };
  static std::unique_ptr<OpenalVoices> create(const std::vector<std::vector<float>>& signals,
                                              const std::vector<Voice>& voices);
  virtual ~OpenalVoices() = default;

  // Sets the pitch and position of each voice, as a moving listener does.
  virtual void move(const std::vector<Voice>& voices) = 0;
  virtual void render(std::span<float> interleaved) = 0;  // left, right
  virtual std::string version() const = 0;
};

}  // namespace clamor
