#include "formats/level/embree_instances.h"

#include <stdexcept>

namespace clamor {

namespace {

// Closes the device when the process or the library ends.
struct Device {
  Device() : device(rtcNewDevice(embree_device(false))) {
    if (device == nullptr) throw std::runtime_error("Embree cannot start");
  }
  ~Device() { rtcReleaseDevice(device); }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  const RTCDevice device;
};

}  // namespace

RTCDevice EmbreeInstances::device() {
  static const Device kDevice;
  return kDevice.device;
}

EmbreeInstances::EmbreeInstances() {
  device_ = device();
  rtcRetainDevice(device_);
  scene_ = rtcNewScene(device_);
  check();
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC);
}

EmbreeInstances::~EmbreeInstances() {
  for (const RTCGeometry instance : instances_)
    if (instance != nullptr) rtcReleaseGeometry(instance);
}

void EmbreeInstances::set(std::size_t slot, const EmbreeMesh& mesh, const Transform& transform) {
  remove(slot);
  if (slot >= instances_.size()) instances_.resize(slot + 1, nullptr);
  RTCGeometry& instance = instances_[slot];
  instance = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
  check();
  rtcSetGeometryInstancedScene(instance, mesh.scene());
  rtcSetGeometryMask(instance, 0xffffffff);  // Embree 4's default is 1
  move(slot, transform);
  rtcAttachGeometryByID(scene_, instance, static_cast<unsigned>(slot));
  check();
}

void EmbreeInstances::move(std::size_t slot, const Transform& transform) {
  RTCGeometry const instance = instances_[slot];
  rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform.data());
  rtcCommitGeometry(instance);
}

void EmbreeInstances::remove(std::size_t slot) {
  if (slot >= instances_.size() || instances_[slot] == nullptr) return;
  rtcDetachGeometry(scene_, static_cast<unsigned>(slot));
  rtcReleaseGeometry(instances_[slot]);
  instances_[slot] = nullptr;
}

}  // namespace clamor
