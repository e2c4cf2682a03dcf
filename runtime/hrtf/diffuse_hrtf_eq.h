// diffuse_hrtf_eq.h: what a head makes of a whole crowd, band by band.
//
// Of most voices a head colours the octaves only (narrowband_voices.h), and within an octave nobody
// can tell one of them. But what they have in common can be heard: a notch that all directions
// share whence a crowd is heard, more on one side than on the other. So at each keyframe the
// crowd's power is gathered by the directions in which the head was measured, in octaves; by their
// energies in ERB bands it follows what the crowd should have in each band and each ear, and what
// octaves alone give it; and the square root of what is between them is a level for each of a
// head's bands, which the buses of octaves are given on their way through them
// (hrtf_filter_bank.h). That costs a voice 48 multiply-adds a keyframe, and all of them together
// one pass over the directions.
//
// Powers add: voices are taken to be unlike each other, as sounds of a crowd are.
//
// Threads: the audio thread's, but for the constructor. Memory: 64 bytes a direction.
#pragma once

#include <array>
#include <vector>

#include "runtime/hrtf/hrtf.h"
#include "runtime/voices/gain_ramp_kernel.h"

namespace clamor {

class DiffuseHrtfEq {
 public:
  explicit DiffuseHrtfEq(const Hrtf& head);

  // At a keyframe: begin(), put every voice that is in octaves between three corners() with its
  // power in them (gain_ramp_kernel.h), then levels(): 1 where nothing is heard.
  void begin() noexcept REALTIME;
  std::array<HrtfCorner, 3> corners(const DirectionMesh::Place& place) noexcept REALTIME {
    std::array<HrtfCorner, 3> all;
    for (std::size_t k = 0; k < all.size(); ++k)
      all[k] = {&head_.octaves(place.corner[k]), &power_[place.corner[k]].at, place.share[k]};
    return all;
  }
  std::array<HrtfGains, kEars> levels() const noexcept REALTIME;

 private:
  static constexpr double kMaxChange = 4;  // 12 dB: beyond is no crowd, but a hole in a head

  const Hrtf& head_;
  struct alignas(64) Power {
    std::array<Bands, kEars> at{};
  };
  std::vector<Power> power_;  // by direction
  // Of an ERB band in an octave's power: linear between the octaves' centres.
  std::array<std::array<float, kErbBandCount>, kBandCount> hat_{};
};

}  // namespace clamor
