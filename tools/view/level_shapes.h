// level_shapes.h: what the window draws of a level: triangles with normals and colours, and the
// outline of a surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/material.h"
#include "common/result.h"
#include "common/vec.h"
#include "formats/level/mesh.h"

namespace clamor {

struct ShadedVertex {
  Vec3f position_m;
  Vec3f normal;  // of its triangle
  Vec3f colour;  // linear, 0 to 1
  float material = 0;
};

// Base colours by the names of materials, from a glTF file; a texture counts with its mean colour.
// Materials without either, and those whose texture cannot be decoded, are left out.
std::map<std::string, Vec3f> base_colours(const std::string& level_path);

// A colour for each material: its base colour, or one of a restrained palette.
std::vector<Vec3f> colours_of(std::span<const Material> materials,
                              const std::map<std::string, Vec3f>& base_colours);

// Three vertices for each triangle.
std::vector<ShadedVertex> shade(const Mesh& mesh, std::span<const Vec3f> colours);

// A surface: the triangles of one material that are connected by edges, as the wall that a triangle
// belongs to; ascending.
std::vector<std::uint32_t> surface_of(const Mesh& mesh, std::uint32_t triangle);

// Ends of the edges of a surface: where it ends, or bends by more than about 25 degrees. Two points
// for each edge.
std::vector<Vec3f> outline_of(const Mesh& mesh, std::span<const std::uint32_t> surface);

// The triangle that a ray hits first, with the distance; SIZE_MAX if none. Linear in the number of
// triangles: a click has time.
struct PickedTriangle {
  std::size_t triangle = SIZE_MAX;
  double distance_m = 0;
};
PickedTriangle pick(const Mesh& mesh, const Vec3& origin_m, const Vec3& direction);

// How far one can go along a ray, at most `max_m`.
double free_m(const Mesh& mesh, const Vec3& from_m, const Vec3& direction, double max_m);

// The nearest of some points that lies within about `radius_m` of a ray and nearer than `limit_m`;
// SIZE_MAX if none. Distant points count as if they were larger, as they are drawn.
std::size_t pick_point(std::span<const Vec3> points_m, const Vec3& origin_m, const Vec3& direction,
                       double limit_m);

}  // namespace clamor
