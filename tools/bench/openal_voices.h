// openal_voices.h: OpenAL Soft mixing voices through its loopback device, where it is installed.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace clamor {

class OpenalVoices {
 public:
  // One source per voice: which of `signals` (looped) it plays, from which sample, at what pitch
  // and how far to the right (-1 to 1). Its gain is 1 / voices. Null where OpenAL Soft is missing
  // or refuses so many sources.
  struct Voice {
    std::size_t signal;
    int start_frame;
    float pitch, right;
  };
  static std::unique_ptr<OpenalVoices> create(const std::vector<std::vector<float>>& signals,
                                              const std::vector<Voice>& voices);
  virtual ~OpenalVoices() = default;

  // Gives each voice the pitch and place of `voices`, as a listener's moving does.
  virtual void move(const std::vector<Voice>& voices) = 0;
  virtual void render(std::span<float> interleaved) = 0;  // left, right
  virtual std::string version() const = 0;
};

}  // namespace clamor
