// audibility_messages.h: describes inaudible emitters and listeners to users.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "bake/report/audibility.h"
#include "formats/level/emitter.h"

namespace clamor {

// A sentence without full stop for each of the first few emitters, as in "'violin' is inside a
// solid ...", and one for all others.
std::vector<std::string> in_words(std::span<const InaudibleEmitter> inaudible,
                                  std::span<const Emitter> emitters);

// A sentence such as "hardly anything is heard at 1,1.7,3: ...".
std::string in_words(const InaudiblePlace& inaudible, const Vec3& listener_m,
                     std::span<const Emitter> emitters);

// This is the sentence about the probe with this number, counted from 1: "probe 2 at 1,1.5,3 lies
// inside ...".
std::string probe_in_words(const InaudiblePlace& place, std::size_t number, const Vec3& probe_m);

}  // namespace clamor
