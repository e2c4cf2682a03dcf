// openal_voices.h: mixes voices with OpenAL Soft, if installed, through its loopback device.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace clamor {

enum class OpenalOutput : std::uint8_t { kStereo, kBinaural };

// The library that renders and its settings, in its own words. A program that asks for nothing gets
// this resampler, and this HRTF status with a loopback device.
struct OpenalLibrary {
  std::string version;          // "1.19.1"
  std::string resampler;        // "Linear"
  int output_hz = 0;            // that of the device, which the benchmark asks for
  std::string hrtf_by_default;  // "disabled"
};

class OpenalVoices {
 public:
  // Each voice is a source that loops one of `signals` from a start frame at a pitch, `right` to
  // the right (-1 to 1), with a gain of 1 / voices. Returns null if OpenAL Soft is missing, refuses
  // so many sources, or gives another output than the one asked for.
  struct Voice {
    std::size_t signal;
    int start_frame;
    float pitch, right;
  };
  static std::unique_ptr<OpenalVoices> create(const std::vector<std::vector<float>>& signals,
                                              const std::vector<Voice>& voices,
                                              OpenalOutput output = OpenalOutput::kStereo);
  virtual ~OpenalVoices() = default;

  // Sets the pitch and position of each voice, as a moving listener does.
  virtual void move(const std::vector<Voice>& voices) = 0;
  virtual void render(std::span<float> interleaved) = 0;  // left, right
  virtual std::string head() const = 0;                   // name of the HRTF; "" for stereo
};

// The installed library; its version is empty if there is none.
OpenalLibrary openal_library();

}  // namespace clamor
