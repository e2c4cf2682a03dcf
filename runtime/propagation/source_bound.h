// source_bound.h: upper bound of the priority of one source, at any time and any place.
//
// The bound is that of radiation_model.h with its constants over u and the full late boost
// (late_boost.h). source_bound_lanes-inl.h evaluates it.
#pragma once

#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/tolerances.h"

namespace clamor {

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
