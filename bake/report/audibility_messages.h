// audibility_messages.h: describes inaudible emitters and listeners to users.
//
// Places that are given are relative to the level's origin; users see them in the world.
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
                                  std::span<const Emitter> emitters,
                                  const Vec3& origin_m = Vec3(0));

// A sentence such as "hardly anything is heard at 1,1.7,3: ...".
std::string in_words(const InaudiblePlace& inaudible, const Vec3& listener_m,
                     std::span<const Emitter> emitters, const Vec3& origin_m = Vec3(0));

// This is the sentence about the probe with this number, counted from 1: "probe 2 at 1,1.5,3 lies
// inside ...".
std::string probe_in_words(const InaudiblePlace& place, std::size_t number, const Vec3& probe_m,
                           const Vec3& origin_m = Vec3(0));

}  // namespace clamor
