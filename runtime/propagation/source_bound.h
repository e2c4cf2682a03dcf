// source_bound.h: upper bound of the priority of one source, at any time and any place.
//
// With r the distance of the listener, o the angle between its direction and the normal, a that
// between its direction and the mirror direction, and i that between normal and mirror direction:
//
//   (diffuse cos o + compensation x exp(-slope x) + lobe min(1, cos o / cos i) exp(-fall (1 - cos
//   a))) / max(r, radius)^2,   x = min(cos o, 1 / slope).
//
// The constants are those of RadiationModel::UpperBound over u, with the full late boost
// (late_boost.h). An emitter is all lobe and radiates to all sides. source_bound_lanes-inl.h
// evaluates the bound.
#pragma once

#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "runtime/propagation/radiation_model.h"

namespace clamor {

// Smaller permanent numbers count as this, so that priorities stay finite.
inline constexpr float kMinU = 0x1p-64f;

struct alignas(64) SourceBound {
  Vec3f position_m{}, normal{}, mirror{};
  float radius2_m2 = 0, diffuse = 0, compensation = 0, lobe = 0, fall = 0;
  float slope = 0;  // -1: an emitter
  float boost = 0;  // late boost at full strength, less 1
};

// `at_1m` is the source's radiation_model upper bound.
SourceBound source_bound(const RadiationModel& radiation, const Source& source,
                         const RadiationModel::UpperBound& at_1m);

}  // namespace clamor
