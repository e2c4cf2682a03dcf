// received_intensity.h: intensity of one source at one place, per band.
//
// The reference definition of intensity, which analysis uses. Sampling and mixing use kernels with
// the same results (intensity_kernel.h, voice_kernel.h).
#pragma once

#include <algorithm>
#include <cassert>
#include <vector>

#include "common/bands.h"
#include "common/reflection.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/emitter.h"

namespace clamor {

// Radius of an emitter: within it, intensity stays constant instead of growing as 1 / r^2.
inline constexpr double kEmitterRadius_m = 0.1;

// Distance within which intensity stays constant: the radius of the patch that a source represents,
// at least that of an emitter.
inline double source_radius_m(const Source& source) {
  return source.is_emitter ? kEmitterRadius_m
                           : std::max<double>(source.patch_radius_m, kEmitterRadius_m);
}

// Fraction of the intensity left after r metres of air, exp(-loss r), per band. Relative error
// below 1e-5.
Bands air_transmittance(const Bands& loss_per_m, double r_m);

// Intensity that `source` gives an omnidirectional receiver, 1 being an emitter of gain 1 at 1 m on
// its axis:
//
//   emitter           I = power (p + 1) / 4 pi ((1 + cos a) / 2)^p   x  air(r) / max(r, radius)^2
//   secondary source  I = power x density of the reflection          x  air(r) / max(r, radius)^2
//
// with air(r) = exp(-m r), m the air's loss, and the source's radius. A secondary source radiates
// on its own side of its surface only. Occlusion is not included.
Bands received_intensity(const Source& source, const std::vector<Emitter>& emitters,
                         const ReflectionLaws& laws, const Bands& air_loss_per_m,
                         const Vec3& receiver_m);

}  // namespace clamor
