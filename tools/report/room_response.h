// room_response.h: what an impulse sounds like at a place of a room.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "formats/bake_file/source.h"
#include "runtime/response/energy_response.h"
#include "tools/analysis/room_parameters.h"
#include "tools/report/room.h"

namespace clamor {

struct RoomResponse {
  Vec3 listener_m{};
  std::vector<Arrival> arrivals;  // sorted by time
  RoomParameters parameters;      // of the energies
};

// The response to the sources of `sample` (fair_sample(), or all of the room), with occlusion and
// diffraction as in clamor impulse. Takes 60 us for each source on two cores.
RoomResponse measure_response(const Room& room, const Excitation& excitation,
                              std::span<const Source> sample, const Vec3& listener_m);

// Measures many places in a hundredth of the time: surfaces hide a reflection or do not, and only
// direct sound is diffracted, unless it is that of a crowd. The room and the excitation must outlive the object.
class QuickResponse {
 public:
  QuickResponse(const Room& room, const Excitation& excitation, std::span<const Source> sample);

  RoomParameters at(const Vec3& listener_m) const;
  std::size_t sources() const { return exact_.size() + reflections_.size(); }

 private:
  const Room& room_;
  const Excitation& excitation_;
  std::vector<Source> exact_;        // emitters, unless they are a crowd, and images
  std::vector<Source> reflections_;  // that have a free side, and a crowd
  std::vector<Vec3f> origins_m_;     // of the rays to these
};

}  // namespace clamor
