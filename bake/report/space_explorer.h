// space_explorer.h: explores the air space of a level with rays: what encloses a point, what it
// sees.
//
// audibility.h judges positions by it. The random numbers are fixed, so results depend on the input
// alone.
//
// Threads: const functions may be called concurrently.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bake/trace/scene.h"
#include "common/material.h"
#include "common/vec.h"
#include "formats/level/mesh.h"

namespace clamor {

// Statistics of random walks from a point.
struct Exploration {
  // Points just in front of the hit surfaces, in the order of the walks.
  std::vector<Vec3> points_m;
  std::size_t escaped = 0;  // walks that left the level
  std::size_t direct = 0;   // walks that left without hitting a surface
  std::size_t behind = 0;   // hits on the back of a surface
  double legs_m = 0;        // total distance between hits
  bool transmits = false;   // whether the sound is heard through any surface

  bool is_enclosed() const;
  double mean_free_path_m() const {
    return points_m.empty() ? 0 : legs_m / static_cast<double>(points_m.size());
  }
};

class SpaceExplorer {
 public:
  static constexpr std::uint32_t kWalks = 64;  // of an exploration

  // Mesh, materials and scene must outlive the object; the scene must be built from the mesh.
  SpaceExplorer(const Scene& scene, const Mesh& mesh, std::span<const Material> materials);

  const Scene& scene() const { return scene_; }
  bool is_empty() const { return empty_; }    // no triangles
  bool is_closed() const { return closed_; }  // most of the bounds are enclosed
  double extent_m() const { return length(high_m_ - low_m_); }
  std::span<const Vec3> enclosed_points_m() const {
    return inside_m_;
  }  // samples, in closed levels

  Exploration explore(const Vec3& from_m) const;

  // Share of the level's bounds that the walks covered, ignoring outliers.
  double share_of_bounds(const Exploration& found) const;

  // Returns whether the line between two points is free, except for surfaces that let much sound
  // through, as curtains do and closed doors do not.
  bool sees(const Vec3& from_m, const Vec3& to_m) const;

  // Returns whether any of the points sees any of the others.
  bool any_sees(std::span<const Vec3> some_m, std::span<const Vec3> others_m) const;

  // Returns whether sound may be diffracted around an obstacle: there is a free path over a point
  // beside the middle of the line. The longest wavelengths reach 8 m beside it.
  bool bends_to(const Vec3& from_m, const Vec3& to_m) const;

  // Returns whether a listener could stand there: no surface is very near.
  bool has_clearance(const Vec3& place_m) const;

  // Alternative points, nearest first: on spheres around the point and on a grid.
  std::vector<Vec3> candidates_m(const Vec3& from_m) const;

  // Normal of a surface within `within_m` of the point, if any.
  std::optional<Vec3> surface_at(const Vec3& place_m, double within_m) const;

 private:
  std::vector<Vec3> grid_m() const;
  bool is_heard_through(std::uint16_t material) const;

  const Scene& scene_;
  std::span<const Material> materials_;
  Vec3 low_m_{}, high_m_{};  // bounds of the triangles
  bool empty_ = true, closed_ = false;
  std::vector<Vec3> inside_m_;
};

// Rounded to centimetres, as printed.
Vec3 rounded_to_cm(const Vec3& place_m);

// At most `max_count` of the values, evenly spaced.
template <class T>
std::vector<T> thinned(std::span<const T> values, std::size_t max_count) {
  if (values.size() <= max_count) return {values.begin(), values.end()};
  std::vector<T> kept;
  for (std::size_t i = 0; i < max_count; ++i) kept.push_back(values[i * values.size() / max_count]);
  return kept;
}

}  // namespace clamor
