// room_response.h: what an impulse sounds like at a place of a room.
//
// A response is made of a sample of the sources, chosen for the place by priority sampling
// (sampler.h), so that energies are unbiased. A source's weight is its share of the intensity
// there, summed over the octaves, times a factor that grows with its delay: half of the sample
// falls to energy, half to all times of the decay alike, because T30 needs late sources as much as
// early ones. u is that of the bake, so that neighbouring places have much the same sample.
//
// Threads: immutable after construction; any thread may use it.
#pragma once

#include <cstddef>
#include <vector>

#include "formats/bake_file/source.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/response/energy_response.h"
#include "tools/analysis/room_parameters.h"
#include "tools/report/room.h"

namespace clamor {

struct RoomResponse {
  Vec3 listener_m{};
  std::size_t sources = 0;        // in the sample
  std::vector<Arrival> arrivals;  // sorted by time
  RoomParameters parameters;      // of the energies
};

class RoomMeter {
 public:
  static constexpr std::size_t kAll = static_cast<std::size_t>(-1);

  // The room must outlive the object.
  RoomMeter(const Room& room, Excitation excitation);

  const Room& room() const { return room_; }
  const Excitation& excitation() const { return excitation_; }

  // The response to `count` sources and to all emitters and images, with the occlusion and
  // diffraction of clamor impulse; kAll gives its figures. Takes 60 us for each source on two
  // cores.
  RoomResponse measure(const Vec3& place_m, std::size_t count) const;  // a place in the world

  // The parameters in a hundredth of the time: surfaces hide a reflection or do not, those by
  // mirrors too, and only direct sound is diffracted, unless it is that of a crowd.
  RoomParameters quick(const Vec3& listener_m, std::size_t count) const;

 private:
  std::vector<Source> chosen(const Vec3& listener_m, std::size_t count) const;

  const Room& room_;
  Excitation excitation_;
  RadiationModel radiation_;
  double t60_s_ = 0;
  std::vector<Source> exact_;   // images and, unless they are a crowd, emitters
  std::vector<Source> others_;  // that are sampled
};

}  // namespace clamor
