#include "formats/level/embree_scene.h"

#include <new>
#include <stdexcept>
#include <string>

#ifdef CLAMOR_HAS_TBB
#include <tbb/task_arena.h>
#endif

namespace clamor {

#ifdef CLAMOR_HAS_TBB

const char* embree_device(bool reproducible) { return reproducible ? "isa=sse4.2" : nullptr; }

// The device option "threads=1" would limit all of TBB.
void EmbreeScene::commit(bool alone) {
  if (alone)
    tbb::task_arena(1).execute([this] { rtcCommitScene(scene_); });
  else
    rtcCommitScene(scene_);
  check();
}

#else  // Embree has its own tasks, and starts no threads for them.

const char* embree_device(bool reproducible) {
  return reproducible ? "isa=sse4.2,threads=1" : "threads=1";
}

void EmbreeScene::commit(bool) {
  rtcCommitScene(scene_);
  check();
}

#endif

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
