// gltf_surfaces.h: which nodes and materials of a glTF scene are no surfaces.
//
// The first of these that says something about a node counts, also for the nodes below it:
//   1. patterns of the command line, then of the sidecar, for the names of the node, its mesh and
//      its materials
//   2. what was decided for its parent
//   3. KHR_node_visibility, "visible" in its extras or in MOZ_hubs_components: hidden meshes
//   4. the rules for names (formats/level/surface_rules.h), MSFT_lod, a navigation mesh of Hubs
// Emitters, probes and portals stay, wherever they are.
#pragma once

#include <vector>

#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/import_report.h"
#include "formats/level/surface_rules.h"

namespace clamor {

struct SceneSurfaces {
  std::vector<NoSurface> nodes;      // by node
  std::vector<NoSurface> materials;  // by material; triangles without material are surfaces
  std::vector<bool> kept_nodes;      // by a pattern, so that no later rule leaves them out

  bool is_surface(int node) const {
    return nodes[static_cast<std::size_t>(node)] == NoSurface::kNothing;
  }
  // `material` may be kNone.
  bool is_material(int material) const {
    return material == kNone ||
           materials[static_cast<std::size_t>(material)] == NoSurface::kNothing;
  }
};

// The hierarchy must be a tree, which place_nodes() has checked. Where the names of all meshes
// match rules, none is left out by its name. Warns of patterns that match nothing.
SceneSurfaces find_surfaces(const GltfScene& scene, SurfaceChoice choice, bool with_hidden,
                            ImportReport& report);

// Reports what is left out, a line for each reason.
void report_left_out(const GltfScene& scene, const std::vector<PlacedNode>& placements,
                     const SceneSurfaces& surfaces, ImportReport& report);

// Lists names and how to keep them: "2 collision hulls: 'UCX_A', 'UCX_B'; --keep NAME ...".
std::string left_out_line(NoSurface reason, const std::vector<std::string>& names);

// The name of a node for people: its own, else that of its mesh, else "node 3".
std::string node_name(const GltfScene& scene, std::size_t node);

}  // namespace clamor
