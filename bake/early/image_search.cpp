#include "bake/early/image_search.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>

#include "bake/trace/image_index.h"
#include "bake/trace/scene.h"
#include "common/reflection.h"
#include "common/sphere.h"
#include "common/thread_team.h"
#include "formats/level/level.h"
#include "formats/level/portal.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxRays = 65'536, kMinRays = 4096, kAllRays = 4 * kMaxRays;
// An image needs one in so many rays, and at least two.
constexpr std::size_t kRaysPerImage = 16'384;
constexpr std::size_t kMaxImagesOfEmitter = 512;
constexpr float kLeastReflected = 1e-3f;  // share of the power, in the loudest band
constexpr std::size_t kBatch = 1024;

// A ray under way.
struct Path {
  Vec3 axis{};
  double travelled_m = 0;
  float reflected = 1;
};

class Search {
 public:
  Search(const Scene& scene, const Level& level, int order)
      : scene_(scene), level_(level), order_(order) {
    for (const Material& material : level.materials)
      max_mirrored_.push_back(std::ranges::max(mirror_reflection(material)));
  }

  std::vector<ImageSource> images_of(std::uint32_t emitter, std::size_t rays) const {
    ImageIndex index;
    std::vector<std::size_t> hits;  // by image
    for (std::size_t first = 0; first < rays; first += kBatch)
      trace(emitter, first, std::min(first + kBatch, rays), rays, index, hits);
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < hits.size(); ++i)
      if (hits[i] >= std::max<std::size_t>(2, rays / kRaysPerImage)) kept.push_back(i);
    std::ranges::stable_sort(kept, std::greater<>(), [&](std::size_t i) { return hits[i]; });
    kept.resize(std::min(kept.size(), kMaxImagesOfEmitter));
    std::vector<ImageSource> images;
    for (const std::size_t i : kept) images.push_back(index.images()[i]);
    return images;
  }

 private:
  void trace(std::uint32_t emitter, std::size_t first, std::size_t end, std::size_t rays_in_all,
             ImageIndex& index, std::vector<std::size_t>& hits_by_image) const {
    const Emitter& source = level_.emitters[emitter];
    std::vector<Ray> rays;
    std::vector<Path> paths;
    for (std::size_t r = first; r < end; ++r) {
      const Vec3 direction =
          spread_direction(static_cast<std::uint32_t>(r), static_cast<std::uint32_t>(rays_in_all));
      rays.push_back({Vec3f(source.position_m), Vec3f(direction)});
      paths.push_back({source.axis});
    }
    std::vector<SurfaceHit> hits(rays.size());
    for (int order = 1; order <= order_ && !rays.empty(); ++order) {
      scene_.first_hits(rays, std::span(hits).first(rays.size()));
      std::size_t alive = 0;
      for (std::size_t r = 0; r < rays.size(); ++r) {
        const SurfaceHit& hit = hits[r];
        if (hit.material == SurfaceHit::kNone) continue;
        Path path = paths[r];
        path.reflected *= max_mirrored_[hit.material];
        if (path.reflected < kLeastReflected) continue;
        const Vec3 from_m(rays[r].origin_m), along(rays[r].direction), normal(hit.normal);
        const Vec3 point_m = from_m + along * static_cast<double>(hit.distance_m);
        // Images do not close with a portal.
        if (std::ranges::any_of(level_.portals, [&](const Portal& portal) {
              return passes(portal, from_m, point_m);
            }))
          continue;
        path.travelled_m += static_cast<double>(hit.distance_m);
        path.axis = mirrored(path.axis, normal);
        const Vec3 leaving = normalize(mirrored(along, normal));
        const std::size_t image =
            index.add({emitter, point_m - leaving * path.travelled_m, path.axis}, path.travelled_m);
        hits_by_image.resize(std::max(hits_by_image.size(), image + 1));
        ++hits_by_image[image];
        paths[alive] = path;
        rays[alive++] = {Vec3f(scene_.away_from_surface(point_m, normal)), Vec3f(leaving)};
      }
      rays.resize(alive);
    }
  }

  const Scene& scene_;
  const Level& level_;
  const int order_;
  // By material: the share of the power that it reflects as a mirror, in its loudest band.
  std::vector<float> max_mirrored_;
};

}  // namespace

int image_order_for(std::size_t emitters) {
  if (emitters <= 16) return 3;
  return emitters <= 64 ? 2 : emitters <= 256 ? 1 : 0;
}

std::vector<ImageSource> find_images(const Scene& scene, const Level& level, int order) {
  std::vector<ImageSource> all;
  if (order <= 0 || level.emitters.empty() || scene.is_empty()) return all;
  const Search search(scene, level, std::min(order, kMaxImageOrder));
  const std::size_t rays = std::clamp(kAllRays / level.emitters.size(), kMinRays, kMaxRays);
  std::vector<std::vector<ImageSource>> by_emitter(level.emitters.size());
  team_for(0, by_emitter.size(), [&](std::size_t e) {
    by_emitter[e] = search.images_of(static_cast<std::uint32_t>(e), rays);
  });
  for (const auto& images : by_emitter) all.insert(all.end(), images.begin(), images.end());
  return all;
}

}  // namespace clamor
