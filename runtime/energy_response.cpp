#include "runtime/energy_response.h"

#include <algorithm>

#include "common/reflection.h"
#include "runtime/received_intensity.h"

namespace clamor {

std::vector<Arrival> energy_response(std::span<const Source> sources,
                                     const std::vector<Emitter>& emitters,
                                     std::span<const Material> materials, const Air& air,
                                     const Vec3& listener_m, std::optional<std::uint32_t> emitter) {
  const ReflectionLaws laws(materials);
  const Bands loss_per_m = air_loss_per_m(air);
  const double speed_mps = speed_of_sound_mps(air);

  std::vector<Arrival> arrivals;
  for (const Source& source : sources) {
    if (emitter && source.emitter != *emitter) continue;
    const Bands energy = received_intensity(source, emitters, laws, loss_per_m, listener_m);
    if (energy == Bands{}) continue;
    const double r_m = length(listener_m - Vec3(source.position_m));
    arrivals.push_back({.time_s = static_cast<double>(source.delay_s) + r_m / speed_mps,
                        .energy = energy,
                        .polarity = source.is_emitter ? 1 : source.polarity});
  }
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.time_s < b.time_s; });
  return arrivals;
}

}  // namespace clamor
