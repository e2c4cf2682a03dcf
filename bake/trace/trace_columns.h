// trace_columns.h: intermediate results of the trace kernel, as structure of arrays.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "bake/trace/kernel_material.h"
#include "bake/trace/trace_kernel.h"

namespace clamor {

constexpr std::size_t kLanes = 32;  // a multiple of the lanes of every instruction set

// One value per photon of a step. The padding avoids arrays 4096 bytes apart, whose reads would
// wait for writes to another (4K aliasing) and which would share cache sets.
template <class T>
using Column = std::array<T, kStepPhotons + 48>;
using VectorColumn = std::array<Column<float>, 3>;

struct RandomColumns {
  std::array<Column<std::uint32_t>, 4> words;
};

struct alignas(64) ShadeScratch {
  // Photons that hit a surface:
  Column<std::uint16_t> slot;
  Column<std::uint32_t> hit;  // index of the hit
  std::array<Column<std::uint32_t>, 2> key, number;
  RandomColumns surface_bits;
  // Power after the surface, times the path's weights.
  alignas(64) std::array<Bands, kStepPhotons> left;
  Column<float> before, after, survival;
  Column<float> random, roulette, keep;

  // Photons that survive roulette:
  Column<std::uint16_t> survivor_slot;
  Column<std::uint32_t> survivor_hit;
  Column<std::uint8_t> drawn;  // band that samples the direction
  RandomColumns direction_bits;
  Column<std::uint32_t> band_bits, lambert_bits;
  VectorColumn normal, mirror, direction;
  Column<float> u1, u2, cos_i, cos_o, log2_cos_a, tilt, loss_cell_i, loss_cell_o;
  Column<float> scattering, inverse_exponent;
  Column<std::uint8_t> transmitted, rejected, specular;
};

struct ShadeArguments {
  const KernelSettings& settings;
  std::span<const KernelMaterial> materials;
  std::uint32_t bounce;
  std::span<KernelPhoton> photons;
  std::span<std::uint16_t> alive;
  std::span<Ray> rays;
  std::span<const SurfaceHit> hits;
  std::span<KernelRun> runs;
  ShadeScratch& scratch;
  DepositSink& sink;
};

}  // namespace clamor
