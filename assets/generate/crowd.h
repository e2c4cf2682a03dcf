// crowd.h: the sounds of a football crowd, each one person's (or one thing's) loop.
//
// A crowd has thirteen kinds of sound. The paper's stadium has one loop of each. A crowd in which
// thousands of fans repeat one loop is periodic itself, so the stadium that we ship has several
// takes of each kind: other voices, pitches, tempi and lengths.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bands.h"

namespace clamor::assets {

struct CrowdSound {
  std::string name;  // also of its file, sounds/NAME.flac
  std::size_t kind = 0;
  std::vector<std::int16_t> samples;
  double share = 1;        // how common it is among the fans
  bool in_unison = false;  // a whole block may take it up
  double gain_db = 0;      // amplitude at 1 m on axis of a full-scale signal
  Bands directivity{};
};

// One sound of each kind.
std::vector<CrowdSound> make_paper_sounds();

// Several takes of each kind, takes of one kind side by side.
std::vector<CrowdSound> make_crowd_sounds();

}  // namespace clamor::assets
