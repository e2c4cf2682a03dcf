#include "bake/journal/run_key.h"

#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

// Increment whenever the tracer's results change, so that older journals no longer match.
constexpr std::uint64_t kTraceVersion = 5;

class Hasher {
 public:
  template <class T>
  Hasher& add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    return add(std::as_bytes(std::span(&value, 1)));
  }
  Hasher& add(std::span<const std::byte> bytes) {
    const std::array<std::uint64_t, 3> parts = {hash_, bytes.size(), hash_of(bytes)};
    hash_ = hash_of(std::as_bytes(std::span(parts)));
    return *this;
  }
  std::uint64_t hash() const { return hash_; }

 private:
  std::uint64_t hash_ = 0;
};

void add_surfaces(const Mesh& mesh, Hasher& hasher) {
  hasher.add(std::as_bytes(std::span(mesh.vertices_m)));
  hasher.add(std::as_bytes(std::span(mesh.triangles)));
  hasher.add(std::as_bytes(std::span(mesh.materials)));
}

void add_portals(std::span<const Portal> portals, Hasher& hasher) {
  for (const Portal& portal : portals)
    hasher.add(portal.centre_m).add(portal.half_u_m).add(portal.half_v_m);
}

}  // namespace

std::string trace_version() { return std::to_string(kTraceVersion); }

std::uint64_t scene_hash(const Level& level, const TraceSettings& settings) {
  Hasher hasher;
  hasher.add(kTraceVersion)
      .add(settings.seed)
      .add(settings.roulette_exponent)
      .add(settings.longest_path_s)
      .add(settings.fade_s)
      .add(settings.speed_mps)
      .add(settings.air_loss_per_m)
      .add(settings.max_bounces)
      .add(settings.deposit_threshold)
      .add(settings.early_until_m)
      .add(settings.early_photons)
      .add(settings.decay.early_m)
      .add(settings.decay.knee_m)
      .add(settings.decay.late_m)
      .add(settings.first_portals.numbers);
  add_surfaces(level.mesh, hasher);
  for (const Material& material : level.materials)
    hasher.add(material.absorption)
        .add(material.scattering)
        .add(material.phong)
        .add(material.transmission);
  add_portals(level.portals, hasher);
  return hasher.hash();
}

std::uint64_t paths_hash(const Level& level, const BakeSettings& settings) {
  Hasher hasher;
  hasher.add(settings.seed)
      .add(settings.roulette_exponent)
      .add(settings.longest_path_s)
      .add(settings.early_order)
      .add(settings.air.temperature_c)
      .add(settings.air.humidity_percent)
      .add(settings.air.pressure_kpa);
  add_surfaces(level.mesh, hasher);
  for (const Material& material : level.materials)
    hasher.add(material.scattering).add(material.phong).add(material.transmission);
  add_portals(level.portals, hasher);
  for (const Emitter& emitter : level.emitters)
    hasher.add(std::as_bytes(std::span(emitter.name)))
        .add(emitter.position_m)
        .add(emitter.axis)
        .add(emitter.gain)
        .add(emitter.directivity);
  return hasher.hash();
}

std::uint64_t run_key(std::uint64_t scene, const Emitter& emitter, std::uint64_t emitter_key,
                      const ImageIndex* images, const PhotonRun& run) {
  Hasher hasher;
  if (images != nullptr)
    for (const ImageSource& image : images->images())
      if (image.emitter == run.emitter) hasher.add(image.position_m);
  return hasher.add(scene)
      .add(emitter_key)
      .add(emitter.position_m)
      .add(emitter.axis)
      .add(emitter.gain)
      .add(emitter.directivity)
      .add(run.first)
      .add(run.count)
      .hash();
}

RunKeys::RunKeys(const Level& level, const PhotonTracer& tracer, std::uint64_t scene)
    : level_(&level), tracer_(&tracer), scene_(scene) {}

const Emitter& RunKeys::emitter_of(const PhotonRun& run) const {
  return level_->emitters[run.emitter];
}

std::uint64_t RunKeys::of(const PhotonRun& run) const {
  return run_key(scene_, emitter_of(run), tracer_->emitter_key(run.emitter),
                 tracer_->settings().images.get(), run);
}

std::vector<std::uint64_t> RunKeys::of_all(const TracedRuns& traced) const {
  std::vector<std::uint64_t> keys;
  for (const TracedRun& run : traced.runs()) keys.push_back(of(run.run));
  return keys;
}

}  // namespace clamor
