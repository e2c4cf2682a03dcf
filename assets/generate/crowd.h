// crowd.h: the thirteen sounds of a football crowd, each one person's (or one thing's) loop.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bands.h"

namespace clamor::assets {

struct CrowdSound {
  std::string name;  // also of its file, sounds/NAME.flac
  std::vector<std::int16_t> samples;
  double share = 1;        // how common it is among the fans
  bool in_unison = false;  // a whole block may take it up
  double gain_db = 0;      // amplitude at 1 m on axis of a full-scale signal
  Bands directivity{};
};

std::vector<CrowdSound> make_crowd_sounds();

}  // namespace clamor::assets
