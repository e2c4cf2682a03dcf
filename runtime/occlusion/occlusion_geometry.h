// occlusion_geometry.h: ray queries against the level's surfaces and its movable parts.
//
// Surfaces block from both sides. The bake file stores sources to 1/256 m and corners to 1 mm, so a
// stored source may lie a few millimetres off its wall. Rays therefore start a little in front of
// the wall, and the wall never shadows its own source. Near a corner, rounding may have moved a
// source behind another wall; the direction that its sound came from then shows the side it belongs
// to. Where that is ambiguous (one source in a thousand) there is no ray origin and the source
// counts as occluded, because sound heard through a wall would be worse.
//
// Threads: const functions may run on any number of threads at once.
// Memory: that of the LevelSurfaces, which the listeners in a level share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/material.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/mesh.h"
#include "runtime/occlusion/level_surfaces.h"
#include "runtime/occlusion/path_segment.h"

namespace clamor {

// Whether a material's surfaces are heard as rows of seats: what they do not scatter, they mirror.
inline bool has_seat_rows(const Material& material) {
  return material.rows_m > 0 && is_mirror(material);
}

class PartScene;
struct MirrorPlane;   // mirror_plane.h
struct MirrorSeries;  // image_mirrors.h

class OcclusionGeometry {
 public:
  // Distance of ray origins from the source's wall; covers the rounding of both.
  static constexpr double kStartOffset_m = 0.005;

  // Throws std::bad_alloc if Embree runs out of memory.
  OcclusionGeometry(std::shared_ptr<LevelSurfaces> level, std::span<const Material> materials,
                    BvhQuality quality = BvhQuality::kHigh);
  // The mirrors are those of the images among the sources.
  OcclusionGeometry(const Mesh& mesh, std::span<const Material> materials,
                    std::span<const Source> sources = {}, BvhQuality quality = BvhQuality::kHigh)
      : OcclusionGeometry(std::make_shared<LevelSurfaces>(mesh, sources), materials, quality) {}

  // Parts that occlude besides the mesh; null: none. They must outlive this or be replaced. Must
  // not run while other threads cast rays.
  void set_parts(const PartScene* parts) { parts_ = parts; }

  bool has_parts() const;
  // Grows whenever a part appears, moves or vanishes.
  std::uint64_t parts_version() const;

  // Whether nothing occludes.
  bool empty() const { return level_->planes().empty() && !has_parts(); }

  // Swaps in the better BVH of kFast if it is finished, and returns true from then on. Never waits.
  // Must not run while other threads cast rays.
  bool improve();

  // Plane of the first surface on the segment, if there is one.
  std::optional<OccluderPlane> first_surface(const Vec3f& from_m, const Vec3f& to_m) const;
  bool is_free(const Vec3f& from_m, const Vec3f& to_m) const;

  // A hit of a surface of the level.
  struct LevelHit {
    float fraction = 0;  // of the segment
    Vec3f normal{};      // unit, to either side
    std::uint16_t material = 0;
  };
  // The first hit of the segment, unless that is on a part.
  std::optional<LevelHit> first_level_hit(const Vec3f& from_m, const Vec3f& to_m) const;

  // The first hit of the segment, on the level or a part.
  struct SurfaceHit {
    float fraction = 0;                   // of the segment
    Vec3f normal{};                       // unit, to either side
    const Bands* mirrored = nullptr;      // share of the power that it reflects as a mirror
    std::optional<std::uint32_t> part{};  // its slot
  };
  std::optional<SurfaceHit> first_hit(const Vec3f& from_m, const Vec3f& to_m) const;

  // first_surface() for the segments whose bit is set in `lanes`; faster for coherent segments.
  // Where a ray passes through the edge between two surfaces, it may find the other surface.
  void first_surfaces(std::span<const PathSegment, kPacketRays> segments, std::uint32_t lanes,
                      std::span<std::optional<OccluderPlane>, kPacketRays> surfaces) const;

  // Share of the power transmitted straight through all surfaces on the segment. Both sides of a
  // wall that is modelled with two surfaces count. Adds the rays cast to `rays`.
  Bands transmission(const Vec3f& from_m, const Vec3f& to_m, std::uint64_t& rays) const;
  bool transmits() const;  // whether any material does

  // Appends the edges with the shortest detours between two points, of the level and its parts, at
  // most `count` and none longer than `longest_m`, in the order of detours.
  void find_edges(const Vec3& from_m, const Vec3& to_m, std::size_t count, double longest_m,
                  std::vector<EdgeBetween>& found) const;
  // Appends edges of the level that lie in a plane, as find_edges() does.
  void find_edges_in(const MirrorPlane& plane, const Vec3& from_m, const Vec3& to_m,
                     std::size_t count, double longest_m, std::vector<EdgeBetween>& found) const;

  // The series of mirrors that lead to an image; none if it is unknown.
  std::span<const MirrorSeries> mirrors_of(const Vec3f& image_m, const Vec3f& original_m) const;

  // The material, if its surfaces are the tops of rows of seats, or null.
  const Material* rows(std::size_t material) const {
    return rows_.empty() || !has_seat_rows(rows_[material]) ? nullptr : &rows_[material];
  }
  bool has_rows() const { return !rows_.empty(); }

  // Share of the power that a material reflects as a mirror.
  const Bands& mirror_reflection(std::size_t material) const { return mirrored_[material]; }

  // Share of the power transmitted through all movable parts on the segment; zero where there are
  // none, and where the level's own surfaces block it: what these transmit is in the bake.
  Bands transmission_of_parts(const Vec3f& from_m, const Vec3f& to_m, std::uint64_t& rays) const;
  bool parts_transmit() const;

  // Start of the source's rays; nothing where that is ambiguous. Parts do not matter. Costs one
  // ray.
  std::optional<Vec3f> ray_origin(const Source& source) const;

 private:
  static constexpr std::uint32_t kNone = 0xffffffff;

  // First triangle of the mesh beyond the fraction `near` of the segment, kNone if there is none.
  // Sets `near` to the fraction of the hit, or 1.
  std::uint32_t first_triangle(const Vec3f& from_m, const Vec3f& to_m, float& near) const;
  std::optional<OccluderPlane> first_wall(const Vec3f& from_m, const Vec3f& to_m) const;
  Bands transmission(const Vec3f& from_m, const Vec3f& to_m, std::uint64_t& rays,
                     bool parts_only) const;

  const std::shared_ptr<LevelSurfaces> level_;
  std::vector<Bands> transmission_;  // per material
  std::vector<Bands> mirrored_;      // per material
  std::vector<Material> rows_;       // all materials, if any has rows of seats
  bool transmits_ = false;
  std::shared_ptr<const EmbreeMesh> embree_;  // null in a free field
  const PartScene* parts_ = nullptr;
  bool improves_;  // until the BVH is final
};

}  // namespace clamor
