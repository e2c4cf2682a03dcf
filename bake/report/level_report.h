// level_report.h: makes a level ready to be traced, and says what it is made of and whether it is
// closed.
//
// A designer reads it before the bake: a missing floor, a gap under a door or a wall that is there
// twice in two materials is cheaper to know now than to hear later.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "bake/mesh/edge_surroundings.h"
#include "bake/mesh/mesh_preparation.h"
#include "bake/report/level_openings.h"
#include "formats/level/level.h"

namespace clamor {

struct LevelOptions {
  double simplify_m = 0;  // how far surfaces may move to save triangles; 0: not at all
};

struct MaterialArea {
  std::string name;
  double read_m2 = 0, area_m2 = 0;  // before and after preparation; one side counts
};

struct MaterialClashNames {
  std::string kept, dropped;
  double area_m2 = 0;
};

struct SimplificationReport {
  double tolerance_m = 0;
  double error_m = 0;  // bound on what was used of it
  std::size_t triangles_before = 0, triangles_after = 0;
  double area_before_m2 = 0, area_after_m2 = 0;
};

// Emitters so near a surface that simplification may have put them on its other side.
struct EmitterAtSurface {
  std::string name;
  double distance_m = 0;
};

struct LevelReport {
  std::size_t triangles_read = 0, triangles = 0;
  double area_read_m2 = 0, area_m2 = 0;
  std::vector<MaterialArea> materials;  // as in the level

  double weld_m = 0;
  std::size_t welded_vertices = 0, degenerate = 0, duplicated = 0, split_edges = 0;
  double duplicated_m2 = 0;
  std::vector<MaterialClashNames> clashes;  // the largest first
  std::optional<SimplificationReport> simplification;
  std::vector<EmitterAtSurface> emitters_at_surfaces;
  std::vector<std::string> unheard_emitters;  // a sentence for each, audibility.h says which

  std::vector<MeshEdge> boundary_edges, feature_edges;  // of the prepared mesh, for diffraction
  double free_edges_m = 0, resting_edges_m = 0;         // length of boundary edges by what they do
  std::vector<ThinGap> gaps;                            // the largest first

  LevelOpenings openings;
  double volume_m3 = 0;  // 0 where the level is not closed
  double extent_m = 0;

  // 4 V / S, where the level is closed and nothing escapes.
  std::optional<double> geometric_free_path_m() const;
};

// Two boundary edges nearer than this, but not together, are a gap nobody meant: two thirds of the
// shortest wavelength.
inline constexpr double kThinGap_m = 0.02;

// Prepares level.mesh in place. The mesh is a function of the mesh and the options alone; emitters
// and materials are only looked at.
LevelReport prepare_level(Level& level, const LevelOptions& options = {});

// Sentences, the few that matter first; and what to look into.
std::vector<std::string> report_lines(const LevelReport& report);
std::vector<std::string> report_warnings(const LevelReport& report);

}  // namespace clamor
