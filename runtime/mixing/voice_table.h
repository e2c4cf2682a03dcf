// voice_table.h: the data that voices are computed from, by slot, in columns for vector code.
//
// Source-dependent data is computed once, when a source takes its slot. Listener-dependent data is
// in columns too, because delays are needed before gains. All columns are padded to whole tiles.
//
// Threads: the sampler's.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/bands.h"
#include "common/reflection_table.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

using VoiceColumn = std::vector<float>;

// Positions, orientations and motions of sources, and the times when their sound leaves them.
struct VoiceGeometry {
  std::array<VoiceColumn, 3> position_m, normal, mirror;  // an emitter's mirror is its axis
  std::array<VoiceColumn, 3> mach;                        // velocities over the speed of sound
  std::vector<bool> moves;                                // by tile: any source in it moves
  std::vector<bool> changed;  // by tile: a source has moved since its voices were placed
  VoiceColumn radius_m;
  // 1/2 for an emitter, whose exponents apply to (1 + cos a) / 2; otherwise 0, for cos a.
  VoiceColumn lift;
  std::vector<double> emission_frames;
  double frames_per_m = 0;
};

// Radiation of sources: power per band, the part of the reflection law that does not depend
// on the listener, and what scales it.
struct VoiceRadiation {
  enum Kind : std::uint8_t { kOmnidirectional, kEmitter, kDiffuse, kReflection };
  std::vector<Kind> kind;
  std::vector<Bands> power;
  std::vector<Bands> compensation;  // the law's, times power and the loss at arrival
  VoiceColumn inverse_cos_i;
  std::vector<const float*> exponent;       // kBandCount, if the kind has any
  std::vector<const ReflectionTable*> law;  // of a reflection
  VoiceColumn sign;
  VoiceColumn scale;              // of power
  std::vector<Bands> power_gain;  // the product of the gain factors, smoothed over keyframes
  Bands air_log2_loss_per_m{};    // powers of 1/2
};

// Sound at the listener, by receiver. Written by place_voices().
struct VoiceArrivals {
  std::array<std::vector<double>, kEars> delay_frames, last_delay_frames;  // last: before a move
  std::array<VoiceColumn, kEars> distance_m, spread, cos_o, loss_cell;
  std::array<VoiceColumn, kEars> log_base;  // log2 of the base of the exponents
  std::array<VoiceColumn, 3> from;          // direction in the listener's axes
};

class VoiceTable {
 public:
  // Slots are processed in tiles of this size.
  static constexpr std::size_t kTile = 16;

  VoiceTable(const RadiationModel& radiation_model, std::size_t slots);

  // Keeps the slots that there are.
  void resize(std::size_t slots);

  void put(std::size_t slot, const Source& source, double start_s);
  // Velocity when the sound that is now heard in the centre left the source; 0 for a source at
  // rest.
  void set_velocity(std::size_t slot, const Vec3f& velocity_mps);
  void move(std::size_t slot, const Vec3f& by_m);

  Vec3f mach_of(std::size_t slot) const { return at(geometry.mach, slot); }
  Vec3f position_of(std::size_t slot) const { return at(geometry.position_m, slot); }
  // `start_s` is when a moving source's sound begins.
  double emission_frames_of(const Source& source, double start_s) const;

  // Inputs and results of the kernels (voice_kernel.h).
  VoiceGeometry geometry;
  VoiceRadiation radiation;
  VoiceArrivals arrivals;

 private:
  static Vec3f at(const std::array<VoiceColumn, 3>& columns, std::size_t slot) {
    return {columns[0][slot], columns[1][slot], columns[2][slot]};
  }

  const RadiationModel& radiation_model_;
};

}  // namespace clamor
