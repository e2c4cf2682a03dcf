#include "bake/report/level_report.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>

#include "bake/mesh/mesh_simplification.h"
#include "bake/mesh/triangle_tree.h"
#include "bake/report/audibility_messages.h"
#include "bake/report/coincident_emitters.h"
#include "bake/trace/scene.h"
#include "common/bounds.h"
#include "common/result.h"
#include "formats/bake_file/enclosure.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr std::size_t kShownOpenings = 3, kShownGaps = 3, kShownClashes = 3;
constexpr std::size_t kKeptGaps = 200;

// Extents below and mean free paths above these suggest a wrong unit of length.
constexpr double kSmallLevel_m = 1, kLargeRoom_m = 60;

// An edge further off its surface than this share of the welding distance borders a seam.
constexpr double kSeamOfWeld = 0.1;

void add_areas(const Mesh& mesh, std::vector<MaterialArea>& materials, double& all_m2,
               double MaterialArea::*where) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double area = area_m2(mesh, t);
    materials[mesh.materials[t]].*where += area;
    all_m2 += area;
  }
}

double area_of(const Mesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += area_m2(mesh, t);
  return sum;
}

double extent_of(const Mesh& mesh) {
  if (mesh.vertices_m.empty()) return 0;
  return bounds_of(mesh.vertices_m).diagonal_m();
}

void simplify(PreparedMesh& prepared, const Level& level, double tolerance_m, LevelReport& report) {
  SimplificationReport simplification;
  simplification.tolerance_m = tolerance_m;
  simplification.triangles_before = prepared.mesh.triangles.size();
  simplification.area_before_m2 = area_of(prepared.mesh);
  const TriangleTree tree(prepared.mesh);
  for (const Emitter& emitter : level.emitters)
    if (const auto surface = tree.nearest(emitter.position_m, tolerance_m, {}, 40'000))
      report.emitters_at_surfaces.push_back({emitter.name, surface->distance_m});

  const Simplification simpler = simplify(prepared, tolerance_m);
  PreparationOptions same;
  same.weld_m = prepared.weld_m;
  prepared = prepare_mesh(simpler.mesh, same);
  simplification.error_m = simpler.error_m;
  simplification.triangles_after = prepared.mesh.triangles.size();
  simplification.area_after_m2 = area_of(prepared.mesh);
  report.simplification = simplification;
}

// Positions of audible emitters, moved off surfaces. Inaudible emitters would explore a space that
// nobody listens to.
std::vector<Vec3> places_that_work_m(const std::vector<Emitter>& emitters,
                                     const std::vector<InaudibleEmitter>& unheard) {
  std::vector<Vec3> places_m;
  auto next = unheard.begin();
  for (std::size_t i = 0; i < emitters.size(); ++i) {
    if (next == unheard.end() || next->emitter != i) {
      places_m.push_back(emitters[i].position_m);
      continue;
    }
    if (next->place.why == InaudibleCause::kOnSurface && next->place.alternative_m)
      places_m.push_back(*next->place.alternative_m);
    ++next;
  }
  return places_m;
}

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string at(const Vec3& place_m) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f})", place_m.x, place_m.y, place_m.z);
}

std::string metres(double length_m) {
  if (length_m < 0.00095) return fmt::format("{:.2f} mm", 1e3 * length_m);
  if (length_m < 0.0095) return fmt::format("{:.1f} mm", 1e3 * length_m);
  if (length_m < 0.0995) return fmt::format("{:.0f} cm", 1e2 * length_m);
  return fmt::format("{:.{}f} m", length_m, length_m < 9.95 ? 1 : 0);
}

std::string percent(double share) {
  return fmt::format("{:.{}f} %", 100 * share, share < 0.00095 ? 2 : share < 0.0995 ? 1 : 0);
}

// Dominant direction of the escaping sound. Through an opening in a wall its mean is 2/3 long, and
// the mean square of its component out of the wall is a half, against a quarter along the wall.
enum class Way { kAllRound, kBothEnds, kUp, kDown, kSideways };
constexpr double kAlongOneAxis = 0.45;

Way way_of(const LevelOpening& opening) {
  const Vec3& d = opening.direction;
  if (length(d) < 0.35) {
    const Vec3& squares = opening.squared_direction;
    const bool has_ends = squares.y < squares.x || squares.y < squares.z;
    return has_ends && std::max(squares.x, squares.z) > kAlongOneAxis &&
                   std::min(squares.x, squares.z) < kAlongOneAxis / 1.5
               ? Way::kBothEnds
               : Way::kAllRound;
  }
  if (std::abs(d.y) < std::max(std::abs(d.x), std::abs(d.z))) return Way::kSideways;
  return d.y > 0 ? Way::kUp : Way::kDown;
}
std::string direction_of(const LevelOpening& opening) {
  const Vec3& d = opening.direction;
  switch (way_of(opening)) {
    case Way::kUp:
      return "upwards";
    case Way::kDown:
      return "downwards";
    case Way::kSideways:
      if (std::abs(d.x) > std::abs(d.z)) return d.x > 0 ? "towards +X" : "towards -X";
      return d.z > 0 ? "towards +Z" : "towards -Z";
    case Way::kBothEnds:
      return opening.squared_direction.x > opening.squared_direction.z ? "towards +X and -X"
                                                                       : "towards +Z and -Z";
    case Way::kAllRound:
      break;
  }
  return "in all directions";
}

std::string question(const LevelOpening& opening, Enclosure enclosure) {
  switch (way_of(opening)) {
    case Way::kUp:
      return "no ceiling there, or open sky?";
    case Way::kDown:
      return "is a floor missing?";
    case Way::kSideways:
      return "is a wall or a door missing?";
    case Way::kBothEnds:
      return "is it open at both ends?";
    case Way::kAllRound:
      break;
  }
  return enclosure == Enclosure::kMostlyOpen ? "the level stands in the open"
                                             : "are parts of it missing?";
}

// Example: "upwards near (1.0, 3.0, 2.0), through an opening about 4 m wide along an open edge of
// 16 m".
std::string in_words(const LevelOpening& opening) {
  const Way way = way_of(opening);
  if (way == Way::kAllRound || way == Way::kBothEnds || !(opening.width_m > 0))
    return direction_of(opening);
  std::string text =
      fmt::format("{} near {}, through an opening about {} wide", direction_of(opening),
                  at(opening.place_m), metres(opening.width_m));
  if (opening.edge_length_m > 0)
    text += fmt::format(" along an open edge of {}", metres(opening.edge_length_m));
  return text;
}

std::string in_words(const ThinGap& gap) {
  return fmt::format("{} wide over {} near {}", metres(gap.width_m), metres(gap.length_m),
                     at(gap.place_m));
}

// "" if nothing was tested.
std::string closedness(const LevelReport& report) {
  const LevelOpenings& found = report.openings;
  if (found.rays == 0) return "";
  if (found.openings.empty()) return fmt::format("closed: none of {} rays left it", found.rays);
  if (report.leaks_through_seams())
    return fmt::format(
        "{} of the sound leaves the level through seams, {} of edges that lie up to {} off the "
        "surface that they rest on, as rounded positions leave them: quantise positions with more "
        "bits, or export them as floating-point numbers",
        percent(found.escaped_share), metres(report.seams_m), metres(report.widest_seam_m));
  const std::size_t worth_naming = static_cast<std::size_t>(std::count_if(
      found.openings.begin(), found.openings.end(),
      [&](const LevelOpening& opening) { return opening.share >= 0.1 * found.escaped_share; }));
  std::string text =
      fmt::format("{} of the sound leaves the level, ", percent(found.escaped_share));
  if (worth_naming > 1) text += fmt::format("first of all ({}) ", percent(found.openings[0].share));
  text += fmt::format("{}: {}", in_words(found.openings[0]),
                      question(found.openings[0], enclosure_of(found.escaped_share)));
  for (std::size_t i = 1; i < std::min(worth_naming, kShownOpenings); ++i)
    text += fmt::format("{} {} {}", i == 1 ? " Then" : ";", percent(found.openings[i].share),
                        in_words(found.openings[i]));
  return text;
}

bool warns_of_openings(const LevelReport& report) {
  const std::vector<LevelOpening>& openings = report.openings.openings;
  return warns_of(enclosure_of(report.openings.escaped_share)) ||
         (!openings.empty() && way_of(openings.front()) == Way::kDown);
}

}  // namespace

LevelFindings findings_in(const LevelReport& report) {
  using Kind = LevelFinding::Kind;
  LevelFindings found;
  found.closedness = closedness(report);
  found.escaped_share = std::min(1.0, report.openings.escaped_share);
  found.thin_gaps = static_cast<std::uint32_t>(report.gaps.size());
  // Seams are everywhere.
  const std::span<const LevelOpening> openings =
      report.leaks_through_seams() ? std::span<const LevelOpening>() : report.openings.openings;
  for (const LevelOpening& opening : openings)
    found.list.push_back(
        {Kind::kOpening,
         fmt::format("{} of the sound leaves {}", percent(opening.share), in_words(opening)),
         opening.width_m > 0 ? std::optional(opening.place_m) : std::nullopt, opening.width_m,
         opening.direction});
  for (std::size_t i = 0; i < std::min(report.gaps.size(), kKeptGaps); ++i) {
    const ThinGap& gap = report.gaps[i];
    found.list.push_back({Kind::kGap, in_words(gap), gap.place_m, gap.length_m, {}});
  }
  return found;
}

std::string gap_line(const LevelFindings& findings) {
  if (findings.thin_gaps == 0) return "";
  std::string text = fmt::format("{} between edges that nearly meet:",
                                 counted(findings.thin_gaps, "thin gap", "thin gaps"));
  std::size_t shown = 0;
  for (const LevelFinding& finding : findings.list)
    if (finding.kind == LevelFinding::Kind::kGap && shown < kShownGaps)
      text += (shown++ == 0 ? " " : "; ") + finding.text;
  return text;
}

std::optional<double> LevelReport::geometric_free_path_m() const {
  if (!(volume_m3 > 0) || !(area_m2 > 0) || openings.escaped > 0) return std::nullopt;
  return 4 * volume_m3 / area_m2;
}

namespace {

void begin_stage(const char* stage, const LevelOptions& options) {
  if (options.on_stage) options.on_stage(stage);
}

bool is_stopped(const LevelOptions& options) {
  return options.stop != nullptr && options.stop->load(std::memory_order_relaxed);
}

// Prepares the mesh and reports what depends on it alone, and the emitters that simplification may
// have moved. Incomplete if it is stopped.
GeometryCache::Entry prepare_geometry(const Level& level, const LevelOptions& options) {
  GeometryCache::Entry made;
  LevelReport& report = made.report;
  for (const Material& material : level.materials) report.materials.push_back({material.name});
  report.triangles_read = level.mesh.triangles.size();
  add_areas(level.mesh, report.materials, report.area_read_m2, &MaterialArea::read_m2);

  begin_stage("welding corners", options);
  PreparedMesh prepared = prepare_mesh(level.mesh, {0, options.rounding_m});
  if (is_stopped(options)) return made;
  report.weld_m = prepared.weld_m;
  report.welded_vertices = prepared.welded_vertices;
  report.degenerate = prepared.degenerate;
  report.duplicated = prepared.duplicated;
  report.duplicated_m2 = prepared.duplicated_m2;
  report.split_edges = prepared.split_edges;
  for (const MaterialClash& clash : prepared.clashes)
    report.clashes.push_back({level.materials[clash.kept].name, level.materials[clash.dropped].name,
                              clash.area_m2, clash.place_m});
  if (options.simplify_m > 0 && !prepared.mesh.triangles.empty()) {
    begin_stage("simplifying surfaces", options);
    simplify(prepared, level, options.simplify_m, report);
  }
  report.volume_m3 = enclosed_volume_m3(prepared);

  made.mesh = std::move(prepared.mesh);
  report.triangles = made.mesh.triangles.size();
  report.extent_m = extent_of(made.mesh);
  add_areas(made.mesh, report.materials, report.area_m2, &MaterialArea::area_m2);
  report.boundary_edges = std::move(prepared.boundary_edges);
  report.feature_edges = std::move(prepared.feature_edges);

  if (is_stopped(options)) return made;
  begin_stage("searching for gaps at open edges", options);
  const TriangleTree tree(made.mesh);
  const auto surroundings =
      classify_edges(made.mesh, tree, report.boundary_edges, 4 * report.weld_m,
                     std::min(kThinGap_m, 0.01 * report.extent_m), options.stop);
  if (is_stopped(options)) return made;
  report.gaps = thin_gaps(report.boundary_edges, surroundings);
  for (std::size_t i = 0; i < surroundings.size(); ++i) {
    const bool rests = surroundings[i].kind == EdgeSurroundings::Kind::kRests;
    (rests ? report.resting_edges_m : report.free_edges_m) += report.boundary_edges[i].length_m;
    if (!rests) made.free_edges.push_back(report.boundary_edges[i]);
    if (rests && surroundings[i].seam_m > kSeamOfWeld * report.weld_m) {
      report.seams_m += report.boundary_edges[i].length_m;
      report.widest_seam_m = std::max(report.widest_seam_m, surroundings[i].seam_m);
    }
    if (surroundings[i].kind == EdgeSurroundings::Kind::kUnknown) ++report.unknown_edges;
  }
  return made;
}

std::vector<std::string> names_of(std::span<const Material> materials) {
  std::vector<std::string> names;
  for (const Material& material : materials) names.push_back(material.name);
  return names;
}

// The prepared geometry, from the cache if it is there.
GeometryCache::Entry geometry_of(const Level& level, const LevelOptions& options) {
  GeometryCache* const cache = options.simplify_m > 0 ? nullptr : options.cache;
  if (cache == nullptr) return prepare_geometry(level, options);
  const auto names = names_of(level.materials);
  if (cache->last && cache->last->materials == names && cache->last->read == level.mesh)
    return *cache->last;
  GeometryCache::Entry made = prepare_geometry(level, options);
  if (is_stopped(options)) return made;
  made.read = level.mesh;
  made.materials = names;
  cache->last = made;
  return made;
}

}  // namespace

LevelReport prepare_level(Level& level, const LevelOptions& options) {
  GeometryCache::Entry geometry = geometry_of(level, options);
  level.mesh = std::move(geometry.mesh);
  LevelReport report = std::move(geometry.report);
  for (ThinGap& gap : report.gaps) gap.place_m += level.origin_m;
  for (MaterialClashNames& clash : report.clashes) clash.place_m += level.origin_m;
  if (is_stopped(options)) return report;
  begin_stage("looking for emitters that are not heard", options);
  const Scene scene(level.mesh, Scene::Build::kQuick);
  if (is_stopped(options)) return report;
  const auto unheard = Audibility(scene, level.mesh, level.materials).inaudible(level.emitters);
  report.unheard_emitters = in_words(unheard, level.emitters, level.origin_m);
  report.coincident_emitters = coincident_emitters(level.emitters, level.origin_m);
  if (is_stopped(options)) return report;
  begin_stage("looking for openings", options);
  report.openings =
      find_openings(scene, level, places_that_work_m(level.emitters, unheard), geometry.free_edges);
  for (LevelOpening& opening : report.openings.openings) opening.place_m += level.origin_m;
  return report;
}

std::vector<std::string> report_lines(const LevelReport& report) {
  std::vector<std::string> lines;
  if (report.triangles == 0) return lines;
  std::string mesh = fmt::format(
      "{} of {:.1f} m2", counted(report.triangles, "triangle", "triangles"), report.area_m2);
  if (report.welded_vertices > 0)
    mesh += fmt::format("; {} welded", counted(report.welded_vertices, "corner", "corners"));
  if (report.degenerate > 0)
    mesh += fmt::format("; {} without area dropped",
                        counted(report.degenerate, "triangle", "triangles"));
  if (report.duplicated > 0)
    mesh += fmt::format("; {} dropped that were there twice ({:.2f} m2)",
                        counted(report.duplicated, "triangle", "triangles"), report.duplicated_m2);
  lines.push_back(mesh);

  if (const auto& simpler = report.simplification) {
    std::string line = fmt::format(
        "simplified within {}: {} triangles instead of {}, area {:+.2f} %",
        metres(simpler->tolerance_m), simpler->triangles_after, simpler->triangles_before,
        100 * (simpler->area_after_m2 / simpler->area_before_m2 - 1));
    const MaterialArea* most = nullptr;
    const auto change = [](const MaterialArea& m) { return m.area_m2 / m.read_m2 - 1; };
    for (const MaterialArea& material : report.materials)
      if (material.read_m2 > 0 &&
          (most == nullptr || std::abs(change(material)) > std::abs(change(*most))))
        most = &material;
    if (most != nullptr && report.materials.size() > 1)
      line += fmt::format(", most in {} ({:+.1f} %)", in_quotes(most->name), 100 * change(*most));
    lines.push_back(line);
  }

  const LevelFindings findings = findings_in(report);
  if (!findings.closedness.empty() && !warns_of_openings(report))
    lines.push_back(findings.closedness);
  if (!report.gaps.empty()) lines.push_back(gap_line(findings));
  if (report.unknown_edges > 0)
    lines.push_back(
        fmt::format("{} not searched for gaps, because so many surfaces cross there",
                    counted(report.unknown_edges, "short edge was", "short edges were")));
  if (report.openings.mean_free_path_m > 0) {
    std::string line = fmt::format("mean free path {:.2f} m", report.openings.mean_free_path_m);
    if (const auto geometric_m = report.geometric_free_path_m())
      line += fmt::format(" (4V/S {:.2f} m, of {:.0f} m3)", *geometric_m, report.volume_m3);
    lines.push_back(line);
  }
  return lines;
}

std::vector<std::string> report_warnings(const LevelReport& report) {
  std::vector<std::string> warnings;
  if (report.extent_m > 0 && report.extent_m < kSmallLevel_m)
    warnings.push_back(
        fmt::format("the whole level is {} across; glTF is in metres: was it made in another unit?",
                    metres(report.extent_m)));
  if (report.openings.escaped_share < 0.5 && report.openings.mean_free_path_m > kLargeRoom_m)
    warnings.push_back(fmt::format(
        "sound goes {} between surfaces, further than in any hall; glTF is in metres: was the "
        "level made in another unit?",
        metres(report.openings.mean_free_path_m)));
  warnings.insert(warnings.end(), report.unheard_emitters.begin(), report.unheard_emitters.end());
  if (warns_of_openings(report)) warnings.push_back(closedness(report));
  warnings.insert(warnings.end(), report.coincident_emitters.begin(),
                  report.coincident_emitters.end());
  for (std::size_t i = 0; i < std::min(report.clashes.size(), kShownClashes); ++i)
    warnings.push_back(
        fmt::format("{:.2f} m2 are there twice, in {} and in {}, near {}; the first in the file "
                    "counts, {}",
                    report.clashes[i].area_m2, in_quotes(report.clashes[i].kept),
                    in_quotes(report.clashes[i].dropped), at(report.clashes[i].place_m),
                    in_quotes(report.clashes[i].kept)));
  if (!report.emitters_at_surfaces.empty())
    warnings.push_back(fmt::format(
        "{} within the tolerance of --simplify from a surface and may have come to lie behind it: "
        "{} is {} away",
        counted(report.emitters_at_surfaces.size(), "emitter lies", "emitters lie"),
        in_quotes(report.emitters_at_surfaces[0].name),
        metres(report.emitters_at_surfaces[0].distance_m)));
  return warnings;
}

}  // namespace clamor
