// embree_mesh.h: a mesh as an Embree scene.
//
// Behind Embree's fence: only the ray casters of the bake and of the runtime include this header.
//
// Threads: const functions may be called concurrently after build().
#pragma once

#include "formats/level/embree_scene.h"
#include "formats/level/mesh.h"

namespace clamor {

class EmbreeMesh : public EmbreeScene {
 public:
  struct Options {
    bool reproducible = true;  // see embree_device()
    RTCBuildQuality quality = RTC_BUILD_QUALITY_HIGH;
    RTCBuildQuality geometry_quality = RTC_BUILD_QUALITY_MEDIUM;  // Embree's default
    bool robust = false;                // no ray slips through the edge between two triangles
    bool alone = false;                 // build() takes the calling thread only
    RTCDevice shared_device = nullptr;  // instead of a device of its own
  };

  // Copies the mesh, which must have triangles. Throws std::bad_alloc, or std::runtime_error if
  // Embree fails otherwise.
  EmbreeMesh(const Mesh& mesh, const Options& options);
  ~EmbreeMesh() { release_geometry(); }

  // Builds the BVH with Embree's threads, or alone. Throws like the
  // constructor.
  void build() { commit(alone_); }

  // For instances of the mesh on the same device.
  RTCScene scene() const { return scene_; }

 private:
  void create(const Mesh& mesh, const Options& options);
  void release_geometry();

  const bool alone_;
  RTCGeometry geometry_ = nullptr;
};

}  // namespace clamor
