// stadium.h: the football stadium of the paper's section 5.1, built anew.
//
// A pitch of 105 x 68 m, boards round it, two tiers of stepped stands on a rounded rectangle with a
// walkway and a concourse between them, a steel roof open above the pitch, and 16 416 fans, each
// with one of the crowd's sounds at their mouth.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "crowd.h"
#include "gltf_writer.h"
#include "seating.h"

namespace clamor::assets {

inline constexpr std::size_t kFanCount = 16416;

// The .glb; sounds are referred to as sounds/NAME.flac.
std::string make_stadium(std::span<const CrowdSound> sounds, const StartTimes& starts);

}  // namespace clamor::assets
