#include "formats/bake_file/enclosure.h"

#include <algorithm>

namespace clamor {

namespace {

constexpr double kLeak = 0.05, kHalf = 0.5;  // shares of the emitted power

}  // namespace

Enclosure enclosure_of(double escaped_share) {
  if (!(escaped_share > 0)) return Enclosure::kClosed;
  if (escaped_share < kLeak) return Enclosure::kLeaks;
  return escaped_share < kHalf ? Enclosure::kOpenings : Enclosure::kMostlyOpen;
}

Enclosure enclosure_of(const LevelFindings& findings) {
  if (findings.closedness.empty()) return Enclosure::kUnknown;
  // Files of older programs have openings without their share.
  const bool has_openings =
      std::ranges::count(findings.list, LevelFinding::Kind::kOpening, &LevelFinding::kind) > 0;
  if (has_openings && findings.escaped_share == 0) return Enclosure::kOpenings;
  return enclosure_of(findings.escaped_share);
}

bool warns_of(Enclosure enclosure) {
  return enclosure == Enclosure::kLeaks || enclosure == Enclosure::kOpenings;
}

}  // namespace clamor
