// received_intensity.h: how loud one source is at one place, per band.
//
// What all mean by loud: measures ask this function; what chooses and mixes sources has kernels
// that give the same faster (intensity_kernel.h, voice_kernel.h).
#pragma once

#include <algorithm>
#include <cassert>
#include <vector>

#include "common/bands.h"
#include "common/reflection.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/level.h"

namespace clamor {

// Nearer than this nothing grows louder: it has a size, and 1 / r^2 has none.
inline constexpr double kEmitterRadius_m = 0.1;

// Within this distance 1 / r^2 stands still: the patch a source stands for, or an emitter's size. A
// patch that touches the ear is no louder than an emitter would be.
inline double source_radius_m(const Source& source) {
  return source.is_emitter ? kEmitterRadius_m
                           : std::max<double>(source.patch_radius_m, kEmitterRadius_m);
}

// What the air leaves of each band's intensity after so many metres: exp(-loss r), within 1e-5.
Bands air_transmittance(const Bands& loss_per_m, double r_m);

// Intensity that `source` gives an omnidirectional receiver, 1 being an emitter of gain 1 at 1 m on
// its axis:
//
//   emitter           I = power (p + 1) / 4 pi ((1 + cos a) / 2)^p   x  air(r) / max(r, radius)^2
//   secondary source  I = power x density of the reflection          x  air(r) / max(r, radius)^2
//
// with air(r) = exp(-m r), m the air's loss, and the radius that of the source. A secondary source
// is heard on its own side of its surface only. Nothing else stands in the way: whether the
// receiver can be seen is the caller's to ask.
Bands received_intensity(const Source& source, const std::vector<Emitter>& emitters,
                         const ReflectionLaws& laws, const Bands& air_loss_per_m,
                         const Vec3& receiver_m);

}  // namespace clamor
