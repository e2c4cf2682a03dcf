// head.h: what a head does to a sound, by where it comes from: a level in narrow bands at each ear
// and the time between the ears.
//
// From the impulse responses of a SOFA file. Levels are those that give the same energy in each of
// 39 ERB bands as the measured response does: first by turns, each band's levels times what is
// missing, then by Gauss and Newton with a little damping, where deep notches need levels of either
// sign. The time between the ears is the lag at which the responses below 1.5 kHz are most alike,
// where ears follow the wave; half of it is added at one ear and taken off at the other. It is one
// time for all frequencies: below, a measured head has more, by 0.07 ms in the octave of 500 Hz and
// 0.1 ms in that of 250 Hz (medians); at 1 kHz it is right within 33 us. Between measured
// directions, levels and times are linear over triangles (direction_mesh.h).
//
// What is common to all directions is taken out, band by band: the resonance of the ear canal,
// which a listener's own ears add again, and the bass that loudspeakers lose in measuring. So in
// the mean over all directions and both ears, a head is as loud as none in each band.
//
// Threads: hear(), hear_octaves() and delay_frames() on any. Memory: 1 kB a direction. Cost:
// reading takes half a second for 710 directions.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "common/result.h"
#include "common/vec.h"
#include "formats/sofa_file.h"
#include "runtime/direction_mesh.h"
#include "runtime/erb_bands.h"
#include "runtime/head_bank.h"
#include "runtime/realtime.h"

namespace clamor {

class Head {
 public:
  // An empty path takes the default head.
  static Result<std::shared_ptr<const Head>> read(const std::string& path);
  explicit Head(const HeadResponses& responses);

  // Levels for a sound from a direction: x ahead, y to the left, z up.
  std::array<HeadLevels, kEars> hear(const Vec3f& from) const noexcept REALTIME;

  // The same in octaves, for buses of octaves: with the energy of the ERB bands of each.
  std::array<Bands, kEars> hear_octaves(const Vec3f& from) const noexcept REALTIME {
    return hear_octaves(place(from));
  }
  std::array<Bands, kEars> hear_octaves(const DirectionMesh::Place& place) const noexcept REALTIME;

  // By the number of a measured direction, as a place has them: energies in ERB bands, and those
  // that the octaves have instead.
  DirectionMesh::Place place(const Vec3f& from) const noexcept REALTIME {
    return mesh_->find(from);
  }
  struct Energies {
    std::array<std::array<float, kErbBandCount>, kEars> measured, octaves;
  };
  std::size_t directions() const { return directions_.size(); }
  const Energies& energies(std::size_t direction) const noexcept REALTIME {
    return directions_[direction].energies;
  }
  // Levels of the bands that change each ERB band by a factor, by a few turns.
  HeadLevels changed_by(const ErbBands& change) const noexcept REALTIME;

  // How much later than at the middle of the head an ear hears it; less than 0 for the nearer one.
  double delay_frames(const Vec3f& from, int ear) const noexcept REALTIME;

 private:
  struct Direction {
    std::array<HeadLevels, kEars> level;
    std::array<Bands, kEars> octave;
    float lag_frames;  // of the right ear after the left
    Energies energies;
  };
  // Of the three directions round this one, by their shares.
  template <class Levels>
  std::array<Levels, kEars> between(
      const DirectionMesh::Place& place,
      std::array<Levels, kEars> Direction::*levels) const noexcept REALTIME;

  std::vector<Direction> directions_;
  std::array<std::array<float, kErbBandCount>, kHeadBands> shares_{};  // a band's, in ERB bands
  std::array<std::array<float, kHeadBands>, kErbBandCount> parts_{};   // an ERB band's, of bands
  std::unique_ptr<const DirectionMesh> mesh_;
};

}  // namespace clamor
