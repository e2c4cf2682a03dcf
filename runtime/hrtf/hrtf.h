// hrtf.h: what a head does to a sound, by where it comes from: a level in narrow bands at each ear
// and the time between the ears.
//
// From the impulse responses of a SOFA file. Levels are those that give the same energy in each of
// 39 ERB bands as the measured response does: first by turns, each band's levels times what is
// missing, then by Gauss and Newton with a little damping, where deep notches need levels of either
// sign. Between measured directions, levels and times are linear over triangles (direction_mesh.h).
//
// The time between the ears (interaural_times.h), half of it added at one ear and taken off at the
// other, is two: above 1.4 kHz that of all envelopes together, and below, in the low layer, that of
// the wave from 90 to 850 Hz. What a fine voice's ears differ by in each ERB band below 1.4 kHz is
// phase on top of that (hrtf_phase_fit.h): within 20 us or 5 % of what was measured, from all of
// KEMAR's directions and from 105 Hz up, below which responses of 11.6 ms tell no phase. A crowd's
// voices have the two times alone: 13 to 79 us off (medians) in single bands, least at 650 Hz.
//
// Above 1.4 kHz all envelopes together are right within 5 us, but for 42 of KEMAR's 710 directions,
// opposite an ear: there sound comes round the head on two ways, the measured time jumps from one
// to the other, and ours slides, by 25 us a degree at most, up to 80 us from it (below the lowest
// directions measured, 40 degrees under the horizon, by up to 70 us a degree). In one octave
// alone envelopes may have another time than all together: medians of 30, 18 and 16 us at 2, 4 and
// 8 kHz.
//
// As the head turns, about any axis, the level at an ear changes by less than 1 dB a degree (0.2
// where KEMAR was measured), and so does each ERB band below 1.6 kHz. Above, where a notch passes,
// single bands change by up to 3.8 dB a degree, on no more than 1.5 % of the way: measured bands
// differ by up to 2.5 dB a degree between neighbours. Below the directions that were measured it is
// up to 11 dB. (In steps of a quarter of a degree.) Nothing jumps: between directions all is
// linear.
//
// What is common to all directions is taken out, band by band: the resonance of the ear canal,
// which a listener's own ears add again, and the bass that loudspeakers lose in measuring. So in
// the mean over all directions and both ears, a head is as loud as none in each band.
//
// Threads: hear(), quadrature_gains(), octaves() and the delays on any. Memory: 1 kB a direction.
// Cost: reading takes a second of CPU for 710 directions, on all cores.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "common/result.h"
#include "common/vec.h"
#include "formats/audio/sofa_file.h"
#include "runtime/hrtf/direction_mesh.h"
#include "runtime/hrtf/hrtf_filter_bank.h"
#include "runtime/hrtf/erb_bands.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class HrtfMagnitudeFit;
class HrtfPhaseFit;

class Hrtf {
 public:
  // An empty path takes the default head.
  static Result<std::shared_ptr<const Hrtf>> read(const std::string& path);
  // Without directions() where it was not measured from all sides; then nothing can be heard.
  explicit Hrtf(const HrirSet& responses);

  // Levels for a sound from a direction: x ahead, y to the left, z up.
  std::array<HrtfGains, kEars> hear(const DirectionMesh::Place& place) const noexcept REALTIME;
  std::array<HrtfGains, kEars> hear(const Vec3f& from) const noexcept REALTIME {
    return hear(place(from));
  }
  // Those of the quadratures.
  std::array<QuadratureGains, kEars> quadrature_gains(
      const DirectionMesh::Place& place) const noexcept REALTIME;

  // The second looks first where the direction was last, at first 0.
  DirectionMesh::Place place(const Vec3f& from) const noexcept REALTIME {
    return mesh_->find(from);
  }
  DirectionMesh::Place place(const Vec3f& from, std::uint32_t& last) const noexcept REALTIME {
    return mesh_->find(from, last);
  }

  // By the number of a measured direction, as a place has them: levels in octaves, for buses of
  // octaves, with the energy of the ERB bands of each; energies in ERB bands, and those that the
  // octaves have instead.
  const std::array<Bands, kEars>& octaves(std::size_t direction) const noexcept REALTIME {
    return directions_[direction].octave;
  }
  struct Energies {
    std::array<std::array<float, kErbBandCount>, kEars> measured, octaves;
  };
  std::size_t directions() const { return directions_.size(); }
  const Energies& energies(std::size_t direction) const noexcept REALTIME {
    return directions_[direction].energies;
  }
  // Levels of the bands that change each ERB band by a factor, by a few turns.
  HrtfGains changed_by(const ErbBands& change) const noexcept REALTIME;

  // How much later than at the middle of the head an ear hears it; less than 0 for the nearer one.
  // Below the parting the time between the ears is longer by low_itd_frames().
  double delay_frames(const Vec3f& from, int ear) const noexcept REALTIME;
  double low_itd_frames(const DirectionMesh::Place& place) const noexcept REALTIME;

 private:
  // First what every voice asks for, in two lines of the cache.
  struct alignas(64) Direction {
    std::array<Bands, kEars> octave;
    float itd_frames;      // of the right ear after the left
    float low_itd_frames;  // by which that is longer in the low layer
    std::array<HrtfGains, kEars> level;
    std::array<QuadratureGains, kEars> across;
    Energies energies;
  };
  struct Measured;
  static std::vector<Measured> measure(const HrirSet& responses,
                                       const std::vector<std::size_t>& kept,
                                       const std::vector<Vec3f>& places);
  static Direction fitted(const Measured& measured, const HrtfMagnitudeFit& fit,
                          const HrtfPhaseFit& phase_fit);
  // Of the three directions round this one, by their shares.
  template <class Levels>
  std::array<Levels, kEars> between(
      const DirectionMesh::Place& place,
      std::array<Levels, kEars> Direction::*levels) const noexcept REALTIME;
  double between(const DirectionMesh::Place& place,
                 float Direction::*frames) const noexcept REALTIME;

  std::vector<Direction> directions_;
  std::array<std::array<float, kErbBandCount>, kHrtfBands> shares_{};  // a band's, in ERB bands
  std::array<std::array<float, kHrtfBands>, kErbBandCount> parts_{};   // an ERB band's, of bands
  std::unique_ptr<const DirectionMesh> mesh_;
};

}  // namespace clamor
