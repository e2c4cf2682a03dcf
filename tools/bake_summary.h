// bake_summary.h: what a designer wants to know of a bake when it is done.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "formats/bake_file.h"
#include "runtime/room_parameters.h"

namespace clamor {

// Decay times of the room round the first emitters, from what the bake keeps: the median over a few
// places, each half way from an emitter to the first surface in some direction. Sources that a
// place cannot see do not count. Nothing in bands, or levels, that are too dry to tell.
struct BakeDecay {
  RoomParameters::Value t30_s;
  std::size_t places = 0;
};
BakeDecay decay_of(const BakeContents& contents);

// The closing lines: warnings first, then decay, energy, what was kept and how to hear it.
void print_bake_summary(const BakeContents& contents, const BakeReport& report,
                        const std::string& output, const std::string& journal, double seconds,
                        std::ostream& err);

}  // namespace clamor
