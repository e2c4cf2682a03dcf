// trace_columns.h: what the parts of the trace kernel share on every instruction set.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "bake/trace/kernel_material.h"
#include "bake/trace/trace_kernel.h"

namespace clamor {

constexpr std::size_t kLanes = 32;  // a multiple of every vector's

// Arrays over the photons of a step, so that lanes can run along them. Padded: at 4096 bytes apart
// a read of one would wait for a write to another, and all would share a few lines of the cache.
template <class T>
using Column = std::array<T, kStepPhotons + 48>;
using VectorColumn = std::array<Column<float>, 3>;

struct RandomColumns {
  std::array<Column<std::uint32_t>, 4> words;
};

struct alignas(64) ShadeScratch {
  // Of those that hit something.
  Column<std::uint16_t> slot;
  Column<std::uint32_t> hit;  // index into the hits
  std::array<Column<std::uint32_t>, 2> key, number;
  RandomColumns fate;
  alignas(64) std::array<Bands, kStepPhotons> left;  // power after the surface, of this path
  Column<float> before, after, reflected, survival;
  Column<float> u, roulette, keep;

  // Of those that go on.
  Column<std::uint16_t> going_slot;
  Column<std::uint32_t> going_hit;
  Column<std::uint8_t> drawn;  // band
  RandomColumns way;
  Column<std::uint32_t> band_bits, lambert_bits;
  VectorColumn normal, mirror, direction;
  Column<float> u1, u2, cos_i, cos_o, log2_cos_a, ratio, loss_place_i, loss_place_o;
  Column<float> scattering, inverse_exponent;
  Column<std::uint8_t> through, rejected;
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
