// level_report.h: prepares a level for tracing and reports on its mesh, materials and openings.
//
// The report is read before the bake: a missing floor, a gap under a door or a wall that exists
// twice in two materials is cheaper to fix now than after listening.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bake/mesh/edge_surroundings.h"
#include "bake/mesh/mesh_preparation.h"
#include "bake/report/level_openings.h"
#include "formats/bake_file/level_findings.h"

namespace clamor {

struct GeometryCache;
struct Level;

struct LevelOptions {
  double simplify_m = 0;  // simplification tolerance; 0: no simplification
  // Set it to end the preparation early. Level and report are then useless.
  const std::atomic<bool>* stop = nullptr;
  GeometryCache* cache = nullptr;  // of an earlier preparation; null: none
  double rounding_m = 0;           // of quantised positions, see mesh_preparation.h
  std::function<void(const char* stage)> on_stage{};  // called when a stage begins; may be empty
};

struct MaterialArea {
  std::string name;
  double read_m2 = 0, area_m2 = 0;  // before and after preparation, counting one side
};

struct MaterialClashNames {
  std::string kept, dropped;
  double area_m2 = 0;
  Vec3 place_m{};  // middle of the largest face
};

struct SimplificationReport {
  double tolerance_m = 0;
  double error_m = 0;  // upper bound of the distance to the original surface
  std::size_t triangles_before = 0, triangles_after = 0;
  double area_before_m2 = 0, area_after_m2 = 0;
};

// An emitter that simplification may have moved to the other side of a surface.
struct EmitterAtSurface {
  std::string name;
  double distance_m = 0;
};

struct LevelReport {
  std::size_t triangles_read = 0, triangles = 0;
  double area_read_m2 = 0, area_m2 = 0;
  std::vector<MaterialArea> materials;  // in the order of the level

  double weld_m = 0;
  std::size_t welded_vertices = 0, degenerate = 0, duplicated = 0, split_edges = 0;
  double duplicated_m2 = 0;
  std::vector<MaterialClashNames> clashes;  // largest area first
  std::optional<SimplificationReport> simplification;
  std::vector<EmitterAtSurface> emitters_at_surfaces;
  std::vector<std::string> unheard_emitters;     // one sentence per emitter, see audibility.h
  std::vector<std::string> coincident_emitters;  // sentences, see coincident_emitters.h

  std::vector<MeshEdge> boundary_edges, feature_edges;  // of the prepared mesh, for diffraction
  double free_edges_m = 0, resting_edges_m = 0;         // total length of boundary edges by kind
  std::size_t unknown_edges = 0;  // boundary edges, the shortest, whose surroundings are unknown
  std::vector<ThinGap> gaps;      // largest area first
  // Resting edges that do not quite touch the surface: their length, and their greatest distance.
  double seams_m = 0, widest_seam_m = 0;

  LevelOpenings openings;
  double volume_m3 = 0;  // 0 for open levels
  double extent_m = 0;

  // Sound leaves the level although all its edges rest on surfaces.
  bool leaks_through_seams() const {
    return openings.escaped > 0 && seams_m > 0 && gaps.empty() && !(free_edges_m > 0);
  }
  // 4 V / S for closed levels without escaped sound; otherwise nothing.
  std::optional<double> geometric_free_path_m() const;
};

// The part of a preparation that depends on the surfaces alone, for programs that prepare the same
// ones again with other emitters and materials.
struct GeometryCache {
  struct Entry {
    Mesh read;                           // before the preparation
    std::vector<std::string> materials;  // their names
    Mesh mesh;
    LevelReport report;  // without audibility and openings
    std::vector<MeshEdge> free_edges;
  };
  std::optional<Entry> last;
};

// Boundary edges closer than this, but not touching, form an unintended gap. Two thirds of the
// shortest wavelength.
inline constexpr double kThinGap_m = 0.02;

// Prepares level.mesh in place. Places in the report are in the world's coordinates. The new mesh
// depends on the old mesh and the options alone; emitters and materials are not changed. With a
// cache, surfaces that it has are not prepared again, unless they are simplified.
LevelReport prepare_level(Level& level, const LevelOptions& options = {});

// Openings and thin gaps in words, for the bake file. The only source of what any command says of
// them.
LevelFindings findings_in(const LevelReport& report);
// "80 thin gaps between edges that nearly meet: ...", the largest of them; "" without gaps.
std::string gap_line(const LevelFindings& findings);

// The report as sentences, most important first, and the warnings.
std::vector<std::string> report_lines(const LevelReport& report);
std::vector<std::string> report_warnings(const LevelReport& report);

}  // namespace clamor
