#include "tools/experiments/baked_level.h"

#include <utility>

#include "bake/bake.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/expanded_sources.h"

namespace clamor {

Result<BakedLevel> BakedLevel::open(const std::string& path) {
  const auto file = BakeFile::open(path, FileAccess::kMap);
  if (!file.ok()) return file.error();
  auto tables = read_signals_and_tables(*file);
  if (!tables.ok()) return tables.error();
  if (tables->emitters.empty()) return Error(path + ": it has no emitters; bake it with one");
  auto mesh = file->read_mesh();
  if (!mesh.ok()) return mesh.error();
  return BakedLevel{{file->provenance().level, std::move(*mesh), file->materials(),
                     std::move(tables->emitters), std::move(tables->signals), tables->air},
                    file->settings()};
}

void BakedLevel::set_phong(const Bands& exponents) {
  for (Material& material : level.materials) {
    material.phong = exponents;
    for (std::size_t b = 0; b < kBandCount; ++b)
      material.scattering[b] = exponents[b] == 0 ? 1.0f : 0.0f;
  }
}

Result<std::unique_ptr<ExperimentScene>> BakedLevel::rebake(std::uint64_t sources) const {
  BakeOptions options;
  options.settings = settings;
  options.settings.sources = sources;
  options.settings.photons = 0;
  options.settings.early_order = 0;
  auto contents = bake(level, options);
  if (!contents.ok()) return contents.error();
  return std::make_unique<ExperimentScene>(AuralizerInput{std::move(contents->octree.sources),
                                                          std::move(contents->emitters),
                                                          level.signals,
                                                          std::move(contents->materials),
                                                          level.air,
                                                          {},
                                                          {},
                                                          contents->statistics.decay});
}

Result<BakedEnergies> BakedEnergies::bake_level(const Level& level, const BakeSettings& settings) {
  BakeOptions options;
  options.settings = settings;
  auto contents = bake(level, options);
  if (!contents.ok()) return contents.error();
  BakedEnergies baked;
  baked.sources_ = std::move(contents->octree.sources);
  const auto images = image_sources(contents->images, contents->emitters);
  baked.sources_.insert(baked.sources_.end(), images.begin(), images.end());
  baked.contents_ = std::move(*contents);
  baked.surfaces_ =
      std::make_unique<const OcclusionGeometry>(level.mesh, level.materials, baked.sources_);
  return baked;
}

std::vector<Arrival> BakedEnergies::at(const Vec3& place_m, std::uint32_t emitter) const {
  return energy_response(sources_, contents_.emitters, contents_.materials, contents_.settings.air,
                         place_m, emitter, surfaces_.get());
}

}  // namespace clamor
