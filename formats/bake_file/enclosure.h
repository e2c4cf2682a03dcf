// enclosure.h: judges how open a level is, for all commands that say so.
#pragma once

#include <string>

#include "formats/bake_file/level_findings.h"

namespace clamor {

enum class Enclosure {
  kUnknown,     // nothing was tested
  kClosed,      // no sound leaves it
  kLeaks,       // so little sound leaves it that nobody may have intended it
  kOpenings,    // a part of the sound leaves it
  kMostlyOpen,  // half of the sound or more leaves it, so that no room decays like it
};

Enclosure enclosure_of(double escaped_share);
Enclosure enclosure_of(const LevelFindings& findings);

// Whether the bake warns of it. A level that is mostly open is so on purpose.
bool warns_of(Enclosure enclosure);

}  // namespace clamor
