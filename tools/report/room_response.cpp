#include "tools/report/room_response.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "formats/bake_file/bake_metadata.h"
#include "runtime/occlusion/mirror_path.h"

namespace clamor {

namespace {

constexpr std::size_t kCrowd = 64;       // more emitters than this are sampled as well
constexpr double kLatest_nepers = 10.4;  // 45 dB: T30 ends at 35

// How many times as likely a source is chosen for the time at which it is heard.
double lateness(double time_s, double t60_s) {
  if (!(t60_s > 0)) return 1;
  const double nepers = std::min(6 * std::numbers::ln10 * time_s / t60_s, kLatest_nepers);
  return 1 + std::expm1(nepers) / kLatest_nepers;
}

}  // namespace

RoomMeter::RoomMeter(const Room& room, Excitation excitation)
    : room_(room),
      excitation_(std::move(excitation)),
      radiation_(room.emitters(), room.file->materials(), room.file->settings().air),
      t60_s_(middle_t30_s(room.file->statistics().decay.t30_s)) {
  const bool is_crowd = !excitation_.emitter && room.emitters().size() > kCrowd;
  for (const Source& source : room.sources) {
    if (excitation_.emitter && source.emitter != *excitation_.emitter) continue;
    const bool always = source.is_image || (source.is_emitter && !is_crowd);
    (always ? exact_ : others_).push_back(source);
  }
}

std::vector<Source> RoomMeter::chosen(const Vec3& listener_m, std::size_t count) const {
  std::vector<const Source*> pointers;
  pointers.reserve(others_.size());
  for (const Source& source : others_) pointers.push_back(&source);
  std::vector<ReceivedIntensity> received(others_.size());
  radiation_.receive(pointers, listener_m, received.data());
  std::array<double, kBandCount> totals{};
  for (const ReceivedIntensity& one : received)
    for (std::size_t b = 0; b < kBandCount; ++b) totals[b] += static_cast<double>(one.intensity[b]);

  struct Candidate {
    double priority, weight;
    std::size_t index;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < others_.size(); ++i) {
    const Source& source = others_[i];
    double share = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (totals[b] > 0) share += static_cast<double>(received[i].intensity[b]) / totals[b];
    if (!(share > 0)) continue;
    const double time_s = static_cast<double>(source.delay_s) +
                          received[i].distance_m / radiation_.speed_of_sound_mps();
    const double weight = share * lateness(time_s, t60_s_);
    candidates.push_back({weight / static_cast<double>(source.u), weight, i});
  }
  double threshold = 0;
  if (candidates.size() > count) {
    const auto last = candidates.begin() + static_cast<std::ptrdiff_t>(count);
    std::nth_element(
        candidates.begin(), last, candidates.end(), [](const Candidate& a, const Candidate& b) {
          return a.priority != b.priority ? a.priority > b.priority : a.index < b.index;
        });
    threshold = last->priority;
    candidates.resize(count);
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.index < b.index; });
  }
  std::vector<Source> sample;
  sample.reserve(candidates.size());
  for (const Candidate& candidate : candidates) {
    Source source = others_[candidate.index];
    const double scale =
        std::max({1.0, threshold / candidate.weight, room_.missing_key / sum_of(source.power)});
    for (float& band : source.power) band = static_cast<float>(scale * static_cast<double>(band));
    sample.push_back(source);
  }
  return sample;
}

RoomResponse RoomMeter::measure(const Vec3& place_m, std::size_t count) const {
  const Vec3 listener_m = place_m - room_.file->origin_m();
  std::vector<Source> sample = chosen(listener_m, count);
  sample.insert(sample.end(), exact_.begin(), exact_.end());
  RoomResponse response;
  response.listener_m = place_m;
  response.sources = sample.size();
  response.arrivals =
      energy_response(sample, room_.emitters(), radiation_.laws(), room_.file->settings().air,
                      listener_m, excitation_.emitter, room_.surfaces.get());
  response.parameters = room_parameters(response.arrivals, excitation_.energy_at_10m);
  return response;
}

RoomParameters RoomMeter::quick(const Vec3& listener_m, std::size_t count) const {
  const Air& air = room_.file->settings().air;
  std::vector<Source> seen = chosen(listener_m, count);
  std::erase_if(seen, [&](const Source& source) {
    const auto origin_m =
        source.is_emitter ? std::optional(source.position_m) : room_.surfaces->ray_origin(source);
    return !origin_m || !room_.surfaces->is_free(*origin_m, Vec3f(listener_m));
  });
  std::vector<Source> direct;
  std::uint64_t rays = 0;
  for (const Source& source : exact_) {
    if (!source.is_image) {
      direct.push_back(source);
      continue;
    }
    const PathEnd image(Vec3(source.position_m), Vec3(source.original_m));
    const auto path = mirror_path(*room_.surfaces, listener_m, image, rays);
    if (!path) continue;
    Source& mirrored = seen.emplace_back(source);
    mirrored.is_image = false;  // its mirrors have been seen
    for (std::size_t b = 0; b < kBandCount; ++b) mirrored.power[b] *= path->reflected[b];
  }
  std::vector<Arrival> arrivals =
      energy_response(direct, room_.emitters(), radiation_.laws(), air, listener_m,
                      excitation_.emitter, room_.surfaces.get());
  const std::vector<Arrival> others = energy_response(seen, room_.emitters(), radiation_.laws(),
                                                      air, listener_m, excitation_.emitter);
  arrivals.insert(arrivals.end(), others.begin(), others.end());
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.time_s < b.time_s; });
  return room_parameters(arrivals, excitation_.energy_at_10m);
}

}  // namespace clamor
