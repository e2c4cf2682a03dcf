// embree_instances.h: an Embree scene of meshes that move as rigid bodies.
//
// A mesh is built once and then instanced. Moving an instance changes its transform, and update()
// builds the BVH of the instances' bounds anew, which has one leaf per instance: the BVHs of the
// meshes stay.
//
// Threads: one at a time; const functions may be called concurrently after update().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/level/embree_mesh.h"

namespace clamor {

class EmbreeInstances : public EmbreeScene {
 public:
  // The device of all meshes that are instanced, which lives as long as the process. Throws
  // std::bad_alloc, or std::runtime_error if Embree fails otherwise.
  static RTCDevice device();

  // A 3 x 4 matrix by columns: three axes and the origin.
  using Transform = std::array<float, 12>;

  EmbreeInstances();
  ~EmbreeInstances();

  // Places an instance in a slot. The mesh must have been built on device() and must outlive the
  // instance.
  void set(std::size_t slot, const EmbreeMesh& mesh, const Transform& transform);
  void move(std::size_t slot, const Transform& transform);
  void remove(std::size_t slot);

  // Makes all changes effective, on the calling thread alone. Throws like device().
  void update() { commit(true); }

 private:
  std::vector<RTCGeometry> instances_;  // by slot, or null
};

}  // namespace clamor
