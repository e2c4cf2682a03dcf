#include "formats/level/embree_scene.h"

#include <new>
#include <stdexcept>
#include <string>

#include <tbb/task_arena.h>

namespace clamor {

void EmbreeScene::commit(bool alone) {
  if (alone)
    tbb::task_arena(1).execute([this] { rtcCommitScene(scene_); });
  else
    rtcCommitScene(scene_);
  check();
}

// Embree stores an error code until it is queried.
void EmbreeScene::check() const {
  const RTCError error = rtcGetDeviceError(device_);
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (device_ == nullptr || error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree cannot build its tree of the level's surfaces (error " +
                             std::to_string(error) + ")");
}

void EmbreeScene::release() {
  if (scene_ != nullptr) rtcReleaseScene(scene_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
  scene_ = nullptr;
  device_ = nullptr;
}

}  // namespace clamor
