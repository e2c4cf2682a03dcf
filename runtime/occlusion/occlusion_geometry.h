// occlusion_geometry.h: the level's surfaces as what stands in the way of sound. Embree ends here.
//
// Surfaces block from both sides. Where exactly a source on a wall is, and where the wall, the file
// says to a few millimetres (positions to 1/256 m, corners to 1 mm), so rays leave a source from a
// little before its wall: never shadowed by it, never behind it. Where another wall is so near that
// rounding may have put the source on its wrong side, the way back to where the sound came from
// tells; if it does not, there is no start, and the source is taken to be hidden: it is one in a
// thousand, and sound that is heard through a wall would be worse.
//
// Threads: all const functions from any number at once.   Memory: about 200 bytes per triangle.
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/material.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/level.h"

namespace clamor {

// n x = offset.
struct OccluderPlane {
  Vec3f normal{};
  float offset_m = 0;

  float height_m(const Vec3f& point_m) const { return glm::dot(normal, point_m) - offset_m; }
};

// A straight piece of a way.
struct PathSegment {
  Vec3f from_m{}, to_m{};
};

// As many of them as are cast at once.
inline constexpr std::size_t kPacketRays = 16;

class OcclusionGeometry {
 public:
  // Far enough before its wall for a source whose place and whose wall are both rounded.
  static constexpr double kStartOffset_m = 0.005;

  // Whole at once; or three times as soon, with rays that take a third longer until improve() finds
  // the better tree, on which a thread works from its first call on. That thread reads `mesh`.
  // Throws std::bad_alloc where Embree finds no memory.
  enum class Ready { kWhole, kSoon };
  OcclusionGeometry(const Mesh& mesh, std::span<const Material> materials,
                    Ready ready = Ready::kWhole);
  ~OcclusionGeometry();

  bool empty() const { return planes_.empty(); }

  // Takes the better tree if it is there: true once it is. Never waits. Not while rays are cast.
  bool improve();

  // Of the first surface on the way, null if there is none.
  const OccluderPlane* first_surface(const Vec3f& from_m, const Vec3f& to_m) const;
  bool is_free(const Vec3f& from_m, const Vec3f& to_m) const;

  // The same as first_surface() for those pieces that have a bit in `lanes`, faster where they go
  // about the same way; of surfaces that meet where a ray comes through, it may be another.
  void first_surfaces(std::span<const PathSegment, kPacketRays> pieces, std::uint32_t lanes,
                      std::span<const OccluderPlane*, kPacketRays> surfaces) const;

  // Share of the power that gets straight through all surfaces on the way: each side of a wall that
  // is modelled with two counts, and none lets through what it reflects. `rays` grows by those
  // cast.
  Bands transmission(const Vec3f& from_m, const Vec3f& to_m, std::uint64_t& rays) const;
  bool lets_through() const { return lets_through_; }  // does any surface, anything?

  // Where rays leave a source; nothing if that cannot be told. Costs one ray.
  std::optional<Vec3f> start(const Source& source) const;

 private:
  struct Embree;
  static std::unique_ptr<Embree> tree_of(const Mesh& mesh, Ready ready);
  static constexpr std::uint32_t kNone = 0xffffffff;

  // The triangle, from `near` to the end of the way (both shares of it); `near` becomes where.
  std::uint32_t first_triangle(const Vec3f& from_m, const Vec3f& to_m, float& near) const;

  std::vector<OccluderPlane> planes_;     // per triangle
  std::vector<std::uint16_t> materials_;  // per triangle
  std::vector<Bands> transmission_;       // per material
  bool lets_through_ = false;             // any of them, anything
  std::unique_ptr<Embree> embree_;
  const Mesh* improves_ = nullptr;  // null: need not
  std::future<std::unique_ptr<Embree>> better_;
};

}  // namespace clamor
