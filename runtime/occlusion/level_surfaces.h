// level_surfaces.h: what all listeners in a level share to cast rays: its surfaces, the edges that
// diffract, the mirrors of its images, and the BVHs.
//
// Threads: any.
// Memory: about 200 bytes per triangle, and 90 per edge that diffracts.
#pragma once

#include <array>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "formats/bake_file/source.h"
#include "formats/level/mesh.h"
#include "runtime/occlusion/diffracting_edges.h"
#include "runtime/occlusion/occluder_plane.h"

namespace clamor {

class EmbreeMesh;
class ImageMirrors;   // image_mirrors.h
struct MirrorSeries;  // image_mirrors.h

// kHigh is the best BVH. kFast takes a third of the time and has rays that take a third longer,
// until better_bvh() replaces it. kHighAlone is kHigh without any other thread than the caller's.
// Rays of kPortable hit the same surfaces on all machines, since they run the instruction set that
// bakes do; of others, a ray in a million may pass an edge on either side.
enum class BvhQuality { kHigh, kFast, kHighAlone, kPortable };

class LevelSurfaces {
 public:
  // The images among the sources are those whose mirrors are looked for.
  explicit LevelSurfaces(Mesh mesh, std::span<const Source> sources = {});
  ~LevelSurfaces();  // waits for the thread that builds the better BVH

  const Mesh& mesh() const { return mesh_; }
  const std::vector<OccluderPlane>& planes() const { return planes_; }  // per triangle
  const DiffractingEdges& edges() const { return edges_; }              // none before bvh()

  // The series of mirrors that lead to an image; none if it is unknown, and before bvh().
  std::span<const MirrorSeries> mirrors_of(const Vec3f& image_m, const Vec3f& original_m) const;

  // The BVH of that quality, built by the first caller, or a better one instead of kFast. Null in a
  // free field. The first of all calls looks for the edges and the mirrors, too: while a listener
  // is made, that comes after its sounds have begun to load. Throws std::bad_alloc if Embree runs
  // out of memory.
  std::shared_ptr<const EmbreeMesh> bvh(BvhQuality quality);

  // kHigh for those who took kFast, which a thread builds from the first call on. Nothing until it
  // is finished, and null if memory for it ran out. Never waits.
  std::optional<std::shared_ptr<const EmbreeMesh>> better_bvh();

 private:
  const Mesh mesh_;
  std::vector<OccluderPlane> planes_;
  std::mutex building_;
  std::vector<Source> images_;  // until their mirrors are found
  DiffractingEdges edges_;
  std::array<std::weak_ptr<const EmbreeMesh>, 4> bvhs_;  // by quality
  std::shared_future<std::shared_ptr<const EmbreeMesh>> better_;
  std::unique_ptr<const ImageMirrors> mirrors_;  // null before bvh()
};

}  // namespace clamor
