// intensity_kernel.h: intensities of many sources at one place, vectorised.
//
// The results equal received_intensity() within 1e-5 of a source's loudest band and 1e-4 of each
// band. Distances and angles are computed in double for 2 to 8 sources at a time, the rest in float
// with one band per lane. The kernel uses additions, multiplications, divisions and square roots
// without contraction, so every CPU gives the same bits. A source's result does not depend on the
// other sources of the call; batches take a fifth of the time of single calls
// (tests/benchmarks/intensity_benchmark.cpp).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/reflection_table.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/emitter.h"

namespace clamor {

// Radiation of emitters and surfaces.
struct RadiationTables {
  std::span<const Emitter> emitters;
  std::vector<ReflectionTable> laws;
  std::vector<std::uint32_t> law_of;  // index into laws, per material
  Bands air_log2_loss_per_m{};        // attenuation of energy: 2^(-loss r)
};

struct ReceivedIntensity {
  Bands intensity{};
  double distance_m = 0;  // distance from the source
};

// Computes one result per source. The sources' emitter and material indices must be valid for the
// tables.
void receive(const RadiationTables& tables, std::span<const Source* const> sources,
             const Vec3& place, ReceivedIntensity* received);

}  // namespace clamor
