// embree_mesh.h: a mesh as an Embree scene: upload, errors, and the calls of Embree 3 and 4.
//
// Behind Embree's fence: only the ray casters of the bake and of the runtime include this header.
//
// Threads: const functions may be called concurrently after build().
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "common/vec.h"
#include "formats/level/mesh.h"

namespace clamor {

class EmbreeMesh {
 public:
  struct Options {
    const char* device = nullptr;  // configuration string of rtcNewDevice()
    RTCBuildQuality quality = RTC_BUILD_QUALITY_HIGH;
    RTCBuildQuality geometry_quality = RTC_BUILD_QUALITY_MEDIUM;  // Embree's default
    bool robust = false;  // no ray slips through the edge between two triangles
    bool alone = false;   // build() takes the calling thread only
  };

  // Copies the mesh, which must have triangles. Throws std::bad_alloc, or std::runtime_error if
  // Embree fails otherwise.
  EmbreeMesh(const Mesh& mesh, const Options& options);
  ~EmbreeMesh() { release(); }
  EmbreeMesh(const EmbreeMesh&) = delete;
  EmbreeMesh& operator=(const EmbreeMesh&) = delete;

  // Builds the BVH with the threads of the calling TBB arena, or alone. Throws like the
  // constructor.
  void build();

  // The first hit of origin + t direction with t from `near` to `far`; geomID is
  // RTC_INVALID_GEOMETRY_ID if there is none.
  RTCRayHit first_hit(const Vec3f& origin_m, const Vec3f& direction, float near, float far) const {
    RTCRayHit ray;
    ray.ray = ray_of(origin_m, direction, near, far);
    ray.hit.geomID = ray.hit.primID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
    rtcIntersect1(scene_, &ray);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &ray);
#endif
    return ray;
  }

  // Returns whether any triangle lies on the segment from `from_m` to `to_m`.
  bool is_occluded(const Vec3f& from_m, const Vec3f& to_m) const {
    RTCRay ray = ray_of(from_m, to_m - from_m, 0, 1);
#if RTC_VERSION_MAJOR >= 4
    rtcOccluded1(scene_, &ray);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_, &context, &ray);
#endif
    return !(ray.tfar > 0);
  }

  // First hits of sixteen similar rays, those with a `valid` of -1.
  void first_hits(const int* valid, RTCRayHit16& rays) const {
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    rtcIntersect16(valid, scene_, &rays, &arguments);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(valid, scene_, &context, &rays);
#endif
  }

 private:
  static RTCRay ray_of(const Vec3f& origin_m, const Vec3f& direction, float near, float far) {
    RTCRay ray;
    ray.org_x = origin_m.x;
    ray.org_y = origin_m.y;
    ray.org_z = origin_m.z;
    ray.tnear = near;
    ray.dir_x = direction.x;
    ray.dir_y = direction.y;
    ray.dir_z = direction.z;
    ray.time = 0;
    ray.tfar = far;
    ray.mask = 0xffffffff;
    ray.id = 0;
    ray.flags = 0;
    return ray;
  }
  void create(const Mesh& mesh, const Options& options);
  void check() const;
  void release();

  const bool alone_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  RTCGeometry geometry_ = nullptr;
};

}  // namespace clamor
