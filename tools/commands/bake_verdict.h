// bake_verdict.h: whether the difference of two bakes can be heard, for clamor diff.
//
// Bakes of one level that differ in their photons alone (a seed, a number of photons or sources)
// are compared by the level and the T30 of each band: with the just-noticeable difference (1 dB, 5
// %; ISO 3382-1), and with the standard errors that the bakes know of themselves.
#pragma once

#include <string>

#include "formats/bake_file/bake_file.h"

namespace clamor {

enum class Audible {
  kNo,     // no level and no T30 differs noticeably
  kMaybe,  // some do, but two bakes that differ in their seed alone may do so, too
  kYes,
};

struct BakeVerdict {
  Audible audible = Audible::kYes;
  std::string sentence;
};

// Judges two bakes that are not the same to the last bit.
BakeVerdict verdict_on(const BakeFile& a, const BakeFile& b);

}  // namespace clamor
