// hrtf.h: a head-related transfer function: for each direction, gains in narrow bands at each ear
// and the interaural time difference (ITD).
//
// Made from the impulse responses of a SOFA file. Gains reproduce the measured energy in each of 39
// ERB bands. They are fitted by multiplicative updates, then by damped Gauss-Newton steps, where
// deep notches need gains of either sign. Between measured directions, gains and ITDs are
// interpolated linearly over triangles (direction_mesh.h).
//
// There are two ITDs (interaural_times.h), half of each added at one ear and subtracted at the
// other. Above 1.4 kHz the ITD is that of the envelope; below, in the low layer, that of the
// waveform from 90 to 850 Hz. Narrowband voices also get the phase difference of each ERB band
// below 1.4 kHz (hrtf_phase_fit.h). runtime/README.md, "Heads", gives the errors of both.
//
// HRTFs are diffuse-field equalised: the average over all directions is removed in each band. This
// removes the resonance of the ear canal, which the listener's own ears add again, and the
// loudspeaker's loss of bass in the measurement. Averaged over all directions and both ears,
// binaural output is therefore as loud as without an HRTF in each band.
//
// The default HRTF is that of the KEMAR dummy head (B. Gardner, K. Martin. HRTF Measurements of a
// KEMAR Dummy-Head Microphone. MIT Media Lab, 1994), which travels inside the program, fitted
// (hrtf_stored.cpp).
//
// Threads: const members on any. Memory: 1 kB per direction. Cost: fitting 710 directions takes two
// seconds of CPU time, on all cores; the default head takes milliseconds.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "common/vec.h"
#include "formats/audio/sofa_file.h"
#include "runtime/hrtf/direction_mesh.h"
#include "runtime/hrtf/erb_bands.h"
#include "runtime/hrtf/hrtf_filter_bank.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class HrtfMagnitudeFit;
class HrtfPhaseFit;

class Hrtf {
 public:
  // An empty path gives the default HRTF. `threads`: 0 takes one per core.
  static Result<std::shared_ptr<const Hrtf>> read(const std::string& path, unsigned threads = 0);
  // directions() is 0 if the measurement does not surround the head; no other member may then be
  // called.
  explicit Hrtf(const HrirSet& responses, unsigned threads = 0);

  // stored() serializes the fit, and from_stored() restores it; null if the header or the size is
  // wrong.
  std::vector<std::byte> stored() const;
  static std::shared_ptr<const Hrtf> from_stored(std::span<const std::byte> bytes);

  // Gains for a direction of arrival: x ahead, y to the left, z up.
  std::array<HrtfGains, kEars> gains(const DirectionMesh::Place& place) const noexcept REALTIME;
  std::array<HrtfGains, kEars> gains(const Vec3f& from) const noexcept REALTIME {
    return gains(place(from));
  }
  // Gains of the quadrature filters.
  std::array<QuadratureGains, kEars> quadrature_gains(
      const DirectionMesh::Place& place) const noexcept REALTIME;

  // The second overload starts its search at the last result, `last`, which is 0 at first.
  DirectionMesh::Place place(const Vec3f& from) const noexcept REALTIME {
    return mesh_->find(from);
  }
  DirectionMesh::Place place(const Vec3f& from, std::uint32_t& last) const noexcept REALTIME {
    return mesh_->find(from, last);
  }

  // By index of a measured direction: octave gains that preserve the energy of the ERB bands in
  // each octave, and energies in ERB bands, measured and as octave gains produce them.
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
  // Band gains that scale each ERB band by `change`, by a few multiplicative updates.
  HrtfGains changed_by(const ErbBands& change) const noexcept REALTIME;

  // Delay at an ear relative to the centre of the head; negative for the nearer ear. In the low
  // layer the ITD is longer by low_itd_frames().
  double delay_frames(const Vec3f& from, int ear) const noexcept REALTIME;
  double low_itd_frames(const DirectionMesh::Place& place) const noexcept REALTIME;

 private:
  // The data that every voice needs comes first, in two cache lines.
  struct alignas(64) Direction {
    std::array<Bands, kEars> octave;
    float itd_frames;      // positive if the right ear is later
    float low_itd_frames;  // added to it in the low layer
    std::array<HrtfGains, kEars> level;
    std::array<QuadratureGains, kEars> across;
    Energies energies;
  };
  struct Measured;
  Hrtf() = default;
  // Calls act(floats) for each part of a direction.
  template <class Act>
  static void for_each_part(Direction& direction, const Act& act);
  static std::vector<Measured> measure(const HrirSet& responses,
                                       const std::vector<std::size_t>& kept,
                                       const std::vector<Vec3f>& places, unsigned threads);
  static Direction fitted(const Measured& measured, const HrtfMagnitudeFit& fit,
                          const HrtfPhaseFit& phase_fit);
  // Interpolates between the three directions of a place.
  template <class Levels>
  std::array<Levels, kEars> between(
      const DirectionMesh::Place& place,
      std::array<Levels, kEars> Direction::*levels) const noexcept REALTIME;
  double between(const DirectionMesh::Place& place,
                 float Direction::*frames) const noexcept REALTIME;

  std::vector<Direction> directions_;
  std::vector<Vec3f> places_;  // unit vectors, one for each direction
  std::array<std::array<float, kErbBandCount>, kHrtfBands> shares_{};  // of a band, over ERB bands
  std::array<std::array<float, kHrtfBands>, kErbBandCount> parts_{};   // of an ERB band, over bands
  std::unique_ptr<const DirectionMesh> mesh_;
};

}  // namespace clamor
