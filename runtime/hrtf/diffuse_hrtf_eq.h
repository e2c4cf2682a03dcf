// diffuse_hrtf_eq.h: equalises the octave-band voices of a crowd to the HRTF in narrow bands.
//
// Most voices get the HRTF in octaves only (narrowband_voices.h), and within an octave nobody can
// hear the difference for a single voice. Their sum, however, would lack what all directions of the
// crowd have in common, such as a notch, which may differ between the ears. At each keyframe the
// power of these voices is therefore accumulated by measured direction and octave. The ERB-band
// energies of the HRTF then give the power that the crowd should have in each band at each ear, and
// the power that octave gains give. The square root of the ratio is a gain for each HRTF band,
// which is applied to the sum of the octave buses (hrtf_filter_bank.h). The cost is 48
// multiply-adds per voice and keyframe, plus one pass over the directions.
//
// Powers are added, as is right for the uncorrelated sounds of a crowd.
//
// Threads: the audio thread, except for the constructor. Memory: 64 bytes per direction.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "runtime/hrtf/hrtf.h"
#include "runtime/voices/gain_ramp_kernel.h"

namespace clamor {

class DiffuseHrtfEq {
 public:
  explicit DiffuseHrtfEq(const Hrtf& head);

  struct alignas(64) Power {
    std::array<Bands, kEars> at{};
  };
  // By direction, so far.
  const std::vector<Power>& powers() const { return power_; }

  // At a keyframe call begin(), then accumulate each octave-band voice between three corners() with
  // its power (gain_ramp_kernel.h), then levels(). Levels are 1 where nothing is audible.
  void begin() noexcept REALTIME;
  std::array<HrtfCorner, 3> corners(const DirectionMesh::Place& place) noexcept REALTIME {
    std::array<HrtfCorner, 3> all;
    for (std::size_t k = 0; k < all.size(); ++k)
      all[k] = {&head_.octaves(place.corner[k]), &power_[place.corner[k]].at, place.share[k]};
    return all;
  }
  // Adds those of another equaliser of the same head.
  void add(std::span<const Power> powers) noexcept REALTIME;
  std::array<HrtfGains, kEars> levels() const noexcept REALTIME;

 private:
  // 12 dB; a larger ratio comes from a deep notch of the HRTF, not from a crowd.
  static constexpr double kMaxChange = 4;

  const Hrtf& head_;
  std::vector<Power> power_;  // by direction
  // Weight of an ERB band in an octave's power: linear between the octave centres.
  std::array<std::array<float, kErbBandCount>, kBandCount> hat_{};
};

}  // namespace clamor
