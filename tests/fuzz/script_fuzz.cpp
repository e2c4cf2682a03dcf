// script_fuzz.cpp: walk files, and scripts of moving sources.
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
      const Listener listener = walk->at(time_s);
      if (!is_finite(listener.position_m) || !is_finite(listener.up())) std::abort();
    }
  }
  if (const auto script = MovingScript::read(path); !script.ok()) {
    if (script.error().message.empty()) std::abort();
  } else if ((script->options(2).max_sources < 1) == script->has_sources()) {
    std::abort();
  }
  return 0;
}
