#include "runtime/response/energy_response.h"

#include <algorithm>

#include "runtime/occlusion/occlusion_batch.h"
#include "runtime/propagation/received_intensity.h"

namespace clamor {

namespace {

// Applies occlusion to arrivals.
void dim(std::vector<Arrival>& arrivals, const std::vector<const Source*>& sources,
         const OcclusionGeometry& surfaces, double speed_mps, const Vec3& listener_m) {
  const std::vector<Bands> visible = fine_visibility(surfaces, speed_mps, sources, listener_m);
  for (std::size_t i = 0; i < arrivals.size(); ++i)
    for (std::size_t b = 0; b < kBandCount; ++b) arrivals[i].energy[b] *= visible[i][b];
}

}  // namespace

std::vector<Arrival> energy_response(std::span<const Source> sources,
                                     const std::vector<Emitter>& emitters,
                                     const ReflectionLaws& laws, const Air& air,
                                     const Vec3& listener_m, std::optional<std::uint32_t> emitter,
                                     const OcclusionGeometry* surfaces) {
  const Bands loss_per_m = air_loss_per_m(air);
  const double speed_mps = speed_of_sound_mps(air);

  std::vector<Arrival> arrivals;
  std::vector<const Source*> heard;
  for (const Source& source : sources) {
    if (emitter && source.emitter != *emitter) continue;
    if (source.is_image && surfaces == nullptr) continue;  // mirrors would have to be seen
    const Bands energy = received_intensity(source, emitters, laws, loss_per_m, listener_m);
    if (energy == Bands{}) continue;
    const double r_m = length(listener_m - Vec3(source.position_m));
    arrivals.push_back({.time_s = static_cast<double>(source.delay_s) + r_m / speed_mps,
                        .energy = energy,
                        .polarity = source.is_emitter ? 1 : source.polarity});
    heard.push_back(&source);
  }
  if (surfaces != nullptr && !surfaces->empty()) {
    dim(arrivals, heard, *surfaces, speed_mps, listener_m);
    std::erase_if(arrivals, [](const Arrival& arrival) { return arrival.energy == Bands{}; });
  }
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.time_s < b.time_s; });
  return arrivals;
}

}  // namespace clamor
