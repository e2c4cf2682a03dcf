#include "runtime/occlusion/level_surfaces.h"

#include <chrono>
#include <exception>
#include <utility>

#include "common/platform/thread.h"
#include "formats/level/embree_mesh.h"
#include "runtime/occlusion/image_mirrors.h"

namespace clamor {

namespace {

std::shared_ptr<const EmbreeMesh> build_bvh(const Mesh& mesh, BvhQuality quality) {
  // Robust mode keeps rays from slipping through the edge between two triangles.
  EmbreeMesh::Options options{.reproducible = quality == BvhQuality::kPortable, .robust = true};
  if (quality == BvhQuality::kFast)
    options.quality = options.geometry_quality = RTC_BUILD_QUALITY_LOW;
  options.alone = quality == BvhQuality::kHighAlone;
  auto bvh = std::make_shared<EmbreeMesh>(mesh, options);
  bvh->build();
  return bvh;
}

template <class Future>
bool is_ready(const Future& future) {
  return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

LevelSurfaces::LevelSurfaces(Mesh mesh, std::span<const Source> sources) : mesh_(std::move(mesh)) {
  for (const Source& source : sources)
    if (source.is_image) images_.push_back(source);
  planes_.reserve(mesh_.triangles.size());
  for (const auto& triangle : mesh_.triangles) planes_.push_back(plane_of(mesh_, triangle));
}

LevelSurfaces::~LevelSurfaces() = default;

std::shared_ptr<const EmbreeMesh> LevelSurfaces::bvh(BvhQuality quality) {
  if (mesh_.triangles.empty()) return nullptr;
  const std::lock_guard lock(building_);
  if (mirrors_ == nullptr) {
    edges_ = DiffractingEdges(mesh_);
    mirrors_ = std::make_unique<const ImageMirrors>(planes_, std::exchange(images_, {}));
  }
  if (quality == BvhQuality::kFast && is_ready(better_) && better_.get() != nullptr)
    return better_.get();
  std::weak_ptr<const EmbreeMesh>& built = bvhs_[static_cast<std::size_t>(quality)];
  std::shared_ptr<const EmbreeMesh> bvh = built.lock();
  if (bvh == nullptr) built = bvh = build_bvh(mesh_, quality);
  return bvh;
}

std::span<const MirrorSeries> LevelSurfaces::mirrors_of(const Vec3f& image_m,
                                                        const Vec3f& original_m) const {
  return mirrors_ == nullptr ? std::span<const MirrorSeries>() : mirrors_->of(image_m, original_m);
}

std::optional<std::shared_ptr<const EmbreeMesh>> LevelSurfaces::better_bvh() {
  const std::unique_lock lock(building_, std::try_to_lock);
  if (!lock.owns_lock()) return {};
  if (!better_.valid())
    better_ = std::async(std::launch::async, [this]() -> std::shared_ptr<const EmbreeMesh> {
      name_thread("occlusion bvh");
      try {
        return build_bvh(mesh_, BvhQuality::kHigh);
      } catch (const std::exception&) {
        return nullptr;
      }
    });
  if (!is_ready(better_)) return {};
  return better_.get();
}

}  // namespace clamor
