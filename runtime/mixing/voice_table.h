// voice_table.h: the data that voices are computed from, by slot, in columns for vector code.
//
// Source-dependent data is computed once, when a source takes its slot: its power per band, the
// part of its reflection law that does not depend on the listener, and its emission time.
// Listener-dependent data is in columns too, because delays are needed before gains.
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

class VoiceTable {
 public:
  // Slots are processed in tiles of this size.
  static constexpr std::size_t kTile = 16;

  VoiceTable(const RadiationModel& field, std::size_t slots);

  void put(std::size_t slot, const Source& source);
  // Velocity when the sound that is now heard in the centre left the source; 0 for a source at
  // rest.
  void set_velocity(std::size_t slot, const Vec3f& velocity_mps);
  Vec3f mach_of(std::size_t slot) const { return {mach[0][slot], mach[1][slot], mach[2][slot]}; }
  void move(std::size_t slot, const Vec3f& by_m);
  Vec3f position_of(std::size_t slot) const {
    return {position_m[0][slot], position_m[1][slot], position_m[2][slot]};
  }
  double emission_frames_of(const Source& source) const;

  // Inputs of the kernels (voice_kernel.h). Columns are padded to whole tiles.
  enum Kind : std::uint8_t { kAllRound, kEmitter, kDiffuse, kReflection };
  using Column = std::vector<float>;
  std::array<Column, 3> position_m, normal, mirror;  // an emitter's mirror is its axis
  std::array<Column, 3> mach;                        // velocities over the speed of sound
  std::vector<bool> moves;                           // by tile: any source in it moves
  Column radius_m, over_cos_i;
  Column
      lift;  // 1/2 for an emitter, whose exponents apply to (1 + cos a) / 2; otherwise 0, for cos a
  std::vector<double> emission_frames;
  std::vector<Bands> power;
  std::vector<Bands> bounce;  // the law's reflectance times power and the loss at arrival
  std::vector<float> sign;
  std::vector<Kind> kind;
  std::vector<const float*> exponent;       // kBandCount, if the kind has any
  std::vector<const ReflectionTable*> law;  // of a reflection
  std::vector<float> scale;                 // of power
  std::vector<Bands> visibility;
  Bands air_log2_loss_per_m{};  // powers of 1/2
  double frames_per_m = 0;

  // Written by place_voices(), by ear.
  std::array<std::vector<double>, kEars> delay_frames;
  std::array<Column, kEars> distance_m, spread, cos_o, loss_cell;
  std::array<Column, kEars> log_base;  // log2 of the base of the exponents
  std::array<Column, 3> from;

 private:
  const RadiationModel& field_;
};

}  // namespace clamor
