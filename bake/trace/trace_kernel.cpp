#include "bake/trace/trace_kernel.h"

#include <string>

#include "bake/trace/trace_columns.h"

// Highway compiles the following once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/trace/trace_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "bake/trace/trace_direction-inl.h"
#include "bake/trace/trace_surface-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

std::size_t shade_here(const ShadeArguments& with) {
  const std::size_t hit_count = attenuate(with);
  draw_decisions(with, hit_count);
  const std::size_t survivors = deposit_and_survive(with, hit_count);
  draw(with.scratch, survivors, with.bounce, Use::kReflection, with.scratch.direction_bits);
  choose_bands(with, survivors);
  sample_proposals(with.scratch, survivors);
  sample_compensation(with, survivors);
  compute_cosines(with.scratch, survivors);
  return update_weights(with, survivors);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(shade_here);
}  // namespace

std::size_t shade(const KernelSettings& settings, std::span<const KernelMaterial> materials,
                  std::uint32_t bounce, std::span<KernelPhoton> photons,
                  std::span<std::uint16_t> alive, std::span<Ray> rays,
                  std::span<const SurfaceHit> hits, std::span<KernelRun> runs,
                  ShadeScratch& scratch, DepositSink& sink) {
  return HWY_DYNAMIC_DISPATCH(shade_here)(
      {settings, materials, bounce, photons, alive, rays, hits, runs, scratch, sink});
}

void TraceTally::add(const TraceTally& other, double power_share) {
  photons += other.photons;
  bounces += other.bounces;
  escaped += other.escaped;
  legs_m += other.legs_m;
  legs += other.legs;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    power_escaped[b] += other.power_escaped[b] * power_share;
    power_unfinished[b] += other.power_unfinished[b] * power_share;
    power_of_images[b] += other.power_of_images[b] * power_share;
  }
}

void DeleteScratch::operator()(ShadeScratch* scratch) const { delete scratch; }

std::unique_ptr<ShadeScratch, DeleteScratch> make_shade_scratch() {
  return std::unique_ptr<ShadeScratch, DeleteScratch>(new ShadeScratch());
}

std::vector<std::string> trace_kernel_targets() {
  std::vector<std::string> names;
  for (std::int64_t targets = hwy::SupportedTargets() & HWY_TARGETS; targets != 0;
       targets &= targets - 1)
    names.emplace_back(hwy::TargetName(targets & -targets));
  return names;
}

void force_trace_kernel_target(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);
  if (name.empty()) return;
  for (std::int64_t targets = hwy::SupportedTargets() & HWY_TARGETS; targets != 0;
       targets &= targets - 1)
    if (name == hwy::TargetName(targets & -targets)) {
      hwy::SetSupportedTargetsForTest(targets & -targets);
      return;
    }
}

}  // namespace clamor

#endif  // HWY_ONCE
