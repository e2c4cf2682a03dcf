// intensity_kernel.h: how loud many sources are at one place, for whatever vectors the CPU has.
//
// What received_intensity() says, within 1e-5 of a source's loudest band and 1e-4 of each: ways and
// angles in double, 2 to 8 sources at a time, the rest in float, the bands of a source at a time.
// Additions, multiplications, divisions and square roots only, none of them fused, so that every
// CPU gives the same bits; and a source gives the same whether it is asked for alone or among
// others, which takes a fifth of the time (tests/benchmarks/intensity_benchmark.cpp).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/reflection_table.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/level.h"

namespace clamor {

// How sources radiate.
struct RadiationTables {
  std::span<const Emitter> emitters;
  std::vector<ReflectionTable> laws;
  std::vector<std::uint32_t> law_of;  // each material
  Bands air_log2_loss_per_m{};        // powers of 1/2
};

struct ReceivedIntensity {
  Bands intensity{};
  double way_m = 0;  // from the source
};

// Writes as many as there are sources, whose indices must point into the tables.
void receive(const RadiationTables& tables, std::span<const Source* const> sources,
             const Vec3& place, ReceivedIntensity* received);

}  // namespace clamor
