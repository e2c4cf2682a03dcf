// panner.h: how much of a voice each channel gets, by where the voice is heard from.
//
// Directions are unit vectors in the listener's axes: x ahead, y to the left, z up.
//
// Loudspeakers: vector base amplitude panning over the triangles of the layout's convex hull. Where
// a layout has none, silent helpers stand above and below and give what they get to all
// loudspeakers alike. Gains are then scaled so that their squares add up to 1: a voice is as loud
// from everywhere. LFE is left silent: it is for effects, not for directions.
//
// V. Pulkki. Virtual Sound Source Positioning Using Vector Base Amplitude Panning. J. Audio Eng.
// Soc. 45(6), 1997. ITU-R BS.2051-3, systems B, I and J, for the places.
//
// Ambisonics: the spherical harmonics themselves (spherical_harmonics.h).
//
// Threads: gains() on any. Cost: some 400 multiply-adds in the largest layout.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/result.h"
#include "common/vec.h"
#include "formats/audio/wav_writer.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

inline constexpr std::size_t kMaxChannels = 16;
using ChannelGains = std::array<float, kMaxChannels>;

class Panner {
 public:
  virtual ~Panner() = default;
  virtual int channels() const noexcept REALTIME = 0;  // even, at most kMaxChannels
  // Those beyond channels() are 0.
  virtual ChannelGains gains(const Vec3f& from) const noexcept REALTIME = 0;
};

struct Loudspeaker {
  Speaker speaker;
  double azimuth_deg;  // to the left
  double elevation_deg;
};
struct LoudspeakerLayout {
  std::string_view name;              // "5.1"
  std::vector<Loudspeaker> speakers;  // in the order of their channels

  std::vector<Speaker> order() const;
};

// An Error that names those that there are.
Result<LoudspeakerLayout> find_layout(std::string_view name);

// x ahead, y left, z up.
Vec3f direction_of(const Loudspeaker& speaker);

std::unique_ptr<Panner> make_loudspeaker_panner(const LoudspeakerLayout& layout);
std::unique_ptr<Panner> make_ambisonic_panner();

}  // namespace clamor
