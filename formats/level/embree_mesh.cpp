#include "formats/level/embree_mesh.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace clamor {

EmbreeMesh::EmbreeMesh(const Mesh& mesh, const Options& options) : alone_(options.alone) {
  try {
    create(mesh, options);
  } catch (...) {
    release_geometry();
    throw;
  }
}

void EmbreeMesh::create(const Mesh& mesh, const Options& options) {
  device_ = options.shared_device;
  if (device_ != nullptr)
    rtcRetainDevice(device_);
  else
    device_ = rtcNewDevice(embree_device(options.reproducible));
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

void EmbreeMesh::release_geometry() {
  if (geometry_ != nullptr) rtcReleaseGeometry(geometry_);
  geometry_ = nullptr;
}

}  // namespace clamor
