// voice_table.h: what voices are made from, by slot and in columns, as vectors want it.
//
// A source's own numbers are worked out once, when it takes its slot: what it gives per band, the
// part of its reflection law that does not depend on the listener, when its sound leaves it. What
// the listener's place says about it is in columns too, since delays are asked for before gains.
//
// The sampler thread's.
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
  // Slots are handled so many at a time.
  static constexpr std::size_t kTile = 16;

  VoiceTable(const RadiationModel& field, std::size_t slots);

  void put(std::size_t slot, const Source& source);
  // As it moved when it left what reaches the head's centre now; 0 where it stands still.
  void set_velocity(std::size_t slot, const Vec3f& velocity_mps);
  Vec3f mach_of(std::size_t slot) const { return {mach[0][slot], mach[1][slot], mach[2][slot]}; }
  void move(std::size_t slot, const Vec3f& by_m);
  Vec3f position_of(std::size_t slot) const {
    return {position_m[0][slot], position_m[1][slot], position_m[2][slot]};
  }
  double emission_frames_of(const Source& source) const;

  // What the kernels read (voice_kernel.h). Columns are as long as whole tiles.
  enum Kind : std::uint8_t { kAllRound, kEmitter, kDiffuse, kReflection };
  using Column = std::vector<float>;
  std::array<Column, 3> position_m, normal, mirror;  // an emitter's mirror is its axis
  std::array<Column, 3> mach;                        // velocities in speeds of sound
  std::vector<bool> moves;                           // by tile: any of it does
  Column radius_m, over_cos_i;
  Column lift;  // 1/2 for an emitter, whose exponents are of (1 + cos a) / 2; else 0, of cos a
  std::vector<double> emission_frames;
  std::vector<Bands> power;
  std::vector<Bands> bounce;  // of the law, times power and the loss at the arrival
  std::vector<float> sign;
  std::vector<Kind> kind;
  std::vector<const float*> exponent;       // kBandCount, where the kind has any
  std::vector<const ReflectionTable*> law;  // of a reflection
  std::vector<float> scale;                 // of power
  std::vector<Bands> visibility;
  Bands air_log2_loss_per_m{};  // powers of 1/2
  double frames_per_m = 0;

  // What place_voices() writes, by ear.
  std::array<std::vector<double>, kEars> delay_frames;
  std::array<Column, kEars> distance_m, spread, cos_o, loss_cell;
  std::array<Column, kEars> log_base;  // log2 of what p is a power of
  std::array<Column, 3> from;

 private:
  const RadiationModel& field_;
};

}  // namespace clamor
