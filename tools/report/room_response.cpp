#include "tools/report/room_response.h"

#include <algorithm>

#include "formats/bake_file/bake_metadata.h"

namespace clamor {

RoomResponse measure_response(const Room& room, const Excitation& excitation,
                              std::span<const Source> sample, const Vec3& listener_m) {
  RoomResponse response;
  response.listener_m = listener_m;
  response.arrivals =
      energy_response(sample, room.emitters(), room.file->materials(), room.file->settings().air,
                      listener_m, excitation.emitter, room.surfaces.get());
  response.parameters = room_parameters(response.arrivals, excitation.energy_at_10m);
  return response;
}

QuickResponse::QuickResponse(const Room& room, const Excitation& excitation,
                             std::span<const Source> sample)
    : room_(room), excitation_(excitation) {
  const bool is_crowd = room.emitters().size() > kMaxExactEmitters && !excitation.emitter;
  for (const Source& source : sample) {
    if (source.is_emitter && is_crowd) {
      reflections_.push_back(source);
      origins_m_.push_back(source.position_m);
    } else if (source.is_emitter || source.is_image) {
      exact_.push_back(source);
    } else if (const auto origin_m = room.surfaces->ray_origin(source)) {
      reflections_.push_back(source);
      origins_m_.push_back(*origin_m);
    }
  }
}

RoomParameters QuickResponse::at(const Vec3& listener_m) const {
  const auto& materials = room_.file->materials();
  const Air& air = room_.file->settings().air;
  std::vector<Arrival> arrivals =
      energy_response(exact_, room_.emitters(), materials, air, listener_m, excitation_.emitter,
                      room_.surfaces.get());
  std::vector<Source> seen;
  for (std::size_t i = 0; i < reflections_.size(); ++i) {
    const Vec3 way_m = listener_m - Vec3(reflections_[i].position_m);
    if ((reflections_[i].is_emitter || dot(way_m, Vec3(reflections_[i].normal)) > 0) &&
        room_.surfaces->is_free(origins_m_[i], Vec3f(listener_m)))
      seen.push_back(reflections_[i]);
  }
  const std::vector<Arrival> later = energy_response(seen, room_.emitters(), materials, air,
                                                     listener_m, excitation_.emitter);
  arrivals.insert(arrivals.end(), later.begin(), later.end());
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.time_s < b.time_s; });
  return room_parameters(arrivals, excitation_.energy_at_10m);
}

}  // namespace clamor
