// panner.h: gains of the output channels by direction of arrival.
//
// Directions are unit vectors in the listener's axes: x ahead, y to the left, z up.
//
// Loudspeakers: vector base amplitude panning (VBAP) over the triangles of the layout's convex
// hull. Virtual loudspeakers above, below and behind close layouts that have none there; their gain
// is spread evenly over all real ones. Gains are normalised to a sum of squares of 1, so that a
// voice is equally loud from every direction. The LFE channel is silent.
//
// V. Pulkki. Virtual Sound Source Positioning Using Vector Base Amplitude Panning. J. Audio Eng.
// Soc. 45(6), 1997. Loudspeaker positions: ITU-R BS.2051-3, systems A, B, I and J.
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
#include "runtime/mixing/output_channels.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class Panner {
 public:
  virtual ~Panner() = default;
  virtual int channels() const noexcept REALTIME = 0;  // even, at most kMaxChannels
  // Gains beyond channels() are 0.
  virtual ChannelGains gains(const Vec3f& from) const noexcept REALTIME = 0;
};

struct Loudspeaker {
  Speaker speaker;
  double azimuth_deg;  // to the left
  double elevation_deg;
};
struct LoudspeakerLayout {
  std::string_view name;              // "5.1"
  std::vector<Loudspeaker> speakers;  // in channel order

  std::vector<Speaker> order() const;
};

// The error lists the layouts that exist.
Result<LoudspeakerLayout> find_layout(std::string_view name);

// x ahead, y left, z up.
Vec3f direction_of(const Loudspeaker& speaker);

std::unique_ptr<Panner> make_loudspeaker_panner(const LoudspeakerLayout& layout);
std::unique_ptr<Panner> make_ambisonic_panner();

}  // namespace clamor
