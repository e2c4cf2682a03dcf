#include "formats/bake_file/bake_check.h"

#include <algorithm>
#include <cmath>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_root_images.h"
#include "formats/bake_file/bake_root_portals.h"
#include "formats/bake_file/first_leg.h"
#include "formats/bake_file/page_layout.h"
#include "formats/bake_file/value_limits.h"

namespace clamor {

namespace {

constexpr float kMaxPowerOfPages = 1e24f;    // largest power that a page can store
constexpr double kWidestMesh_m = 4'294'967;  // 2^32 millimetres
constexpr std::size_t kMaxSignal_frames = std::size_t{kSampleRate_hz} * 1800;

bool near(const Vec3f& place_m) {
  return std::abs(place_m.x) <= kMaxCoordinateInFile_m &&
         std::abs(place_m.y) <= kMaxCoordinateInFile_m &&
         std::abs(place_m.z) <= kMaxCoordinateInFile_m;
}

bool is_unit(const Vec3f& direction) { return std::abs(length(direction) - 1) < 1e-3f; }

// Describes what is wrong with a source, or returns null.
const char* wrong_with(const Source& source, const BakeContents& contents, std::size_t emitters) {
  if (source.emitter >= emitters) return "names an emitter that does not exist";
  if (!(source.u > 0 && source.u <= 1)) return "has a u outside (0, 1]";
  if (source.is_emitter && source.emitter >= contents.emitters.size())
    return "is a virtual emitter";
  if (source.is_emitter) return nullptr;  // the emitter table defines the rest
  if (source.material >= contents.materials.size()) return "names a material that does not exist";
  if (!near(source.position_m)) return "lies outside the coordinate range";
  if (!is_unit(source.normal) || !is_unit(source.mirror))
    return "has directions that are not unit vectors";
  if (!(source.delay_s >= 0 && source.delay_s <= 86400)) return "has a delay out of range";
  if (!std::isfinite(source.patch_radius_m)) return "has a patch radius out of range";
  for (const float power : source.power)
    if (!(power >= 0 && power <= kMaxPowerOfPages)) return "has a power out of range";
  return nullptr;
}

Result<void> check_octree(const SourceOctree& octree, const BakeContents& contents,
                          std::size_t emitters) {
  std::size_t first = 0;
  for (const OctreeNode& node : octree.nodes) {
    if (node.first_source != first || node.source_count > octree.sources.size() - first)
      return Error("the nodes do not partition the sources");
    if (!near(node.low_m) || !near(node.high_m))
      return Error("a node lies outside the coordinate range");
    first += node.source_count;
  }
  if (first != octree.sources.size()) return Error("the nodes do not partition the sources");
  for (std::size_t i = 0; i < octree.sources.size(); ++i)
    if (const char* const wrong = wrong_with(octree.sources[i], contents, emitters))
      return Error("source " + std::to_string(i) + " " + wrong);
  for (const OctreeNode& node : octree.nodes)
    for (std::size_t i = 0; i < node.source_count; ++i) {
      const Source& source = octree.sources[static_cast<std::size_t>(node.first_source) + i];
      if (!source.is_emitter &&
          !page_layout::grid_box_of(node).holds(position_code(source.position_m)))
        return Error("source " + std::to_string(node.first_source + i) + " lies outside its node");
    }
  return {};
}

Result<void> check_probe_tree(const SourceOctree& tree, const BakeContents& contents) {
  if (tree.nodes.empty()) return Error("has no tree");
  for (const Source& source : tree.sources)
    if (source.is_emitter) return Error("has an emitter");
  return check_octree(tree, contents, stored_first_legs(contents.portals));
}

Result<void> check_probes(const BakeContents& contents) {
  for (const BakedProbe& probe : contents.probes.places) {
    if (!near(Vec3f(probe.position_m))) return Error("a probe lies outside the coordinate range");
    if (probe.zone >= contents.probes.zones.size())
      return Error("a probe names a zone that does not exist");
    if (const auto done = check_probe_tree(probe.tree, contents); !done.ok())
      return done.error().in("a probe");
  }
  for (const SourceOctree& zone : contents.probes.zones)
    if (const auto done = check_probe_tree(zone, contents); !done.ok())
      return done.error().in("a zone of probes");
  return {};
}

Result<void> check_mesh(const BakeContents& contents) {
  const Mesh& mesh = contents.mesh;
  if (mesh.materials.size() != mesh.triangles.size())
    return Error("the triangles and their materials differ in number");
  for (const std::uint16_t material : mesh.materials)
    if (material >= contents.materials.size())
      return Error("a triangle names a material that does not exist");
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle)
      if (corner >= mesh.vertices_m.size())
        return Error("a triangle names a vertex that does not exist");
  if (mesh.triangles.empty()) return {};
  Vec3f low = mesh.vertices_m[0], high = low;
  for (const Vec3f& vertex : mesh.vertices_m) {
    if (!near(vertex)) return Error("a vertex lies outside the coordinate range");
    low = glm::min(low, vertex);
    high = glm::max(high, vertex);
  }
  for (int axis = 0; axis < 3; ++axis)
    if (static_cast<double>(high[axis]) - low[axis] > kWidestMesh_m)
      return Error("the geometry is wider than 4294 km");
  return {};
}

Result<void> check_signals(const std::vector<Signal>& signals) {
  for (const Signal& signal : signals)
    if (signal.samples.empty() || signal.samples.size() > kMaxSignal_frames ||
        !std::all_of(signal.samples.begin(), signal.samples.end(),
                     [](float sample) { return std::abs(sample) < 1e6f; }))
      return Error("signal " + in_quotes(signal.name) +
                   " is empty, longer than 30 minutes or has samples out of range");
  return {};
}

}  // namespace

Result<void> check_bake(const BakeContents& contents) {
  if (const auto done =
          check_portals(contents.portals, contents.emitters.size(), contents.movable_parts.size());
      !done.ok())
    return done;
  if (const auto done = check_images(contents.images, contents.emitters.size()); !done.ok())
    return done;
  const std::size_t emitters = contents.emitters.size() + contents.portals.emitters.size();
  if (const auto done = check_octree(contents.octree, contents, emitters); !done.ok()) return done;
  if (const auto done = check_probes(contents); !done.ok()) return done;
  if (const auto done = check_mesh(contents); !done.ok()) return done;
  if (const auto done = check_movable_parts(contents.movable_parts, contents.materials.size());
      !done.ok())
    return done;
  return check_signals(contents.signals);
}

}  // namespace clamor
