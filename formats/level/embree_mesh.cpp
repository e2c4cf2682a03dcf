#include "formats/level/embree_mesh.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <string>

#include <tbb/task_arena.h>

namespace clamor {

EmbreeMesh::EmbreeMesh(const Mesh& mesh, const Options& options) : alone_(options.alone) {
  try {
    create(mesh, options);
  } catch (...) {
    release();
    throw;
  }
}

void EmbreeMesh::create(const Mesh& mesh, const Options& options) {
  device_ = rtcNewDevice(options.device);
  check();
  scene_ = rtcNewScene(device_);
  check();
  rtcSetSceneBuildQuality(scene_, options.quality);
  if (options.robust) rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  check();
  if (options.geometry_quality != RTC_BUILD_QUALITY_MEDIUM)
    rtcSetGeometryBuildQuality(geometry_, options.geometry_quality);
  auto* vertices = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                                                               mesh.vertices_m.size()));
  auto* indices = static_cast<std::array<std::uint32_t, 3>*>(
      rtcSetNewGeometryBuffer(geometry_, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.triangles.size()));
  check();  // both are null if memory is exhausted
  std::copy(mesh.vertices_m.begin(), mesh.vertices_m.end(), vertices);
  std::copy(mesh.triangles.begin(), mesh.triangles.end(), indices);
  rtcSetGeometryMask(geometry_, 0xffffffff);  // Embree 4's default is 1
  rtcCommitGeometry(geometry_);
  rtcAttachGeometry(scene_, geometry_);
}

void EmbreeMesh::build() {
  if (alone_)
    tbb::task_arena(1).execute([this] { rtcCommitScene(scene_); });
  else
    rtcCommitScene(scene_);
  check();
}

// Embree stores an error code until it is queried.
void EmbreeMesh::check() const {
  const RTCError error = rtcGetDeviceError(device_);
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (device_ == nullptr || error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree cannot build its tree of the level's surfaces (error " +
                             std::to_string(error) + ")");
}

void EmbreeMesh::release() {
  if (geometry_ != nullptr) rtcReleaseGeometry(geometry_);
  if (scene_ != nullptr) rtcReleaseScene(scene_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

}  // namespace clamor
