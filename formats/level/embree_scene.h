// embree_scene.h: ray queries against an Embree scene: errors, and the calls of Embree 3 and 4.
//
// Threads: const functions may be called concurrently once the scene is committed.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "common/vec.h"

namespace clamor {

// Configuration of a device. Embree's AVX2 and AVX-512 code uses fused multiply-add and another
// tree layout, so a reproducible device, whose hits are the same on all machines, runs the SSE4.2
// code. In the bake this costs 20 to 30 % of the ray throughput (4.7 instead of 6.0 million rays
// per second on Sponza, 2.6 instead of 3.8 in another run).
const char* embree_device(bool reproducible = true);

class EmbreeScene {
 public:
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

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

 protected:
  EmbreeScene() = default;
  ~EmbreeScene() { release(); }

  // Throws std::bad_alloc or std::runtime_error if an Embree call of this thread has failed.
  void check() const;
  // Builds or updates the BVH, with Embree's threads or alone.
  void commit(bool alone);
  void release();

  RTCDevice device_ = nullptr;  // owns a reference
  RTCScene scene_ = nullptr;

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
};

}  // namespace clamor
