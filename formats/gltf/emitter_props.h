// emitter_props.h: recognises the meshes that are the thing which sounds, as the case of a radio.
//
// A designer puts the sound of a radio into the middle of its mesh. Games do not let a thing muffle
// its own sound, and neither does the bake: the mesh is then no surface. A mesh is the prop of an
// emitter if it surrounds it and
//   - is at most half a metre long, or
//   - belongs to the emitter's object (the nodes below the emitter's, or below its parent's) and is
//     too small to be a room; where it is the whole level, its faces must also point outwards.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "formats/gltf/gltf_mesh.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/gltf_surfaces.h"
#include "formats/gltf/import_report.h"
#include "formats/level/emitter.h"

namespace clamor {

class EmitterProps {
 public:
  // Refers to all of them.
  EmitterProps(const GltfScene& scene, const SceneSurfaces& surfaces, const SceneMesh& mesh);

  // Finds the objects of emitters of the scene, whose nodes are `nodes`. Emitters of a name for
  // which `moves` is true stand elsewhere.
  void add_objects(std::span<const Emitter> emitters, std::span<const int> nodes,
                   const std::function<bool(const std::string&)>& moves);

  // Finds small meshes round emitters of any origin.
  void add_small(std::span<const Emitter> emitters);

  // Removes what was found from the mesh that this object refers to, and says so.
  void leave_out(SceneMesh& mesh, ImportReport& report) const;

 private:
  std::vector<std::size_t> object_below(int node) const;
  bool is_prop(std::span<const std::size_t> object, const Vec3& place_m, double longest_m) const;
  void add(std::span<const std::size_t> object, const std::string& emitter);

  const GltfScene& scene_;
  const SceneSurfaces& surfaces_;
  const SceneMesh& mesh_;
  std::vector<Boundsf> bounds_;  // by placement
  Boundsf level_bounds_;
  std::vector<std::size_t> first_of_;            // by node, the first of its placements
  std::map<std::size_t, std::string> emitters_;  // by placement of a prop, one that it surrounds
};

}  // namespace clamor
