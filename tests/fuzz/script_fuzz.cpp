// script_fuzz.cpp: a listener's way, and moving sources as a script has them.
#include <cmath>

#include "formats/level/walk_file.h"
#include "runtime/sampling/moving_script.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = fuzz::file_with(fuzz::text_of(data, size), ".json");
  if (const auto walk = Walk::read(path); !walk.ok()) {
    if (walk.error().message.empty()) std::abort();
  } else {
    for (const double time_s : {-1.0, 0.0, 1.5, walk->length_s(), 1e6}) {
      const Listener pose = walk->at(time_s);
      if (!std::isfinite(pose.position_m.x + pose.yaw_rad)) std::abort();
    }
  }
  if (const auto script = MovingScript::read(path); !script.ok()) {
    if (script.error().message.empty()) std::abort();
  } else if (script->options(2).most < 1) {
    std::abort();
  }
  return 0;
}
