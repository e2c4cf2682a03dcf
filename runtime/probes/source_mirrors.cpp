#include "runtime/probes/source_mirrors.h"

#include <algorithm>
#include <numeric>

#include "common/random.h"
#include "formats/bake_file/image_source.h"

namespace clamor {

namespace {

constexpr float kRaysOfImage = 2;  // that a mirror needs, of those of all sets

float rays_of(const SourceMirrors::Mirror& mirror, std::size_t sets) {
  return std::accumulate(mirror.rays.begin(),
                         mirror.rays.begin() + static_cast<std::ptrdiff_t>(sets), 0.0f);
}

bool is_free(const SourceMirrors::Mirror& mirror) {
  return !(rays_of(mirror, SourceMirrors::kSets) > 0);
}

}  // namespace

void SourceMirrors::clear(std::uint64_t key) {
  mirrors_.clear();
  key_ = key;
}

void SourceMirrors::begin_set(std::size_t set) {
  for (Mirror& mirror : mirrors_) mirror.rays[set] = 0;
}

std::uint32_t SourceMirrors::add(std::size_t set, const Vec3& place_m, const MirrorPlane& plane,
                                 float reflected, float rays) {
  const Vec3 image_m = plane.image_of(place_m);
  const double within_m = image_tolerance_m(length(image_m - place_m));
  const auto known = std::ranges::find_if(mirrors_, [&](const Mirror& mirror) {
    return length(mirror.plane.image_of(place_m) - image_m) <= within_m &&
           dot(mirror.plane.normal, plane.normal) > 0;
  });
  const auto index = known == mirrors_.end() ? insert(plane)
                                             : static_cast<std::uint32_t>(known - mirrors_.begin());
  mirrors_[index].rays[set] += rays;
  mirrors_[index].reflected = std::max(mirrors_[index].reflected, reflected);
  return index;
}

std::uint32_t SourceMirrors::insert(const MirrorPlane& plane) {
  auto place = std::ranges::find_if(mirrors_, is_free);
  if (place == mirrors_.end()) place = mirrors_.insert(mirrors_.end(), Mirror());
  *place = Mirror{.plane = plane, .number = next_number_++};
  place->u = static_cast<float>(unit_above_zero(philox(key_, {2, place->number, 0, 0})[0]));
  return static_cast<std::uint32_t>(place - mirrors_.begin());
}

void SourceMirrors::end_set(std::size_t traced) {
  for (Mirror& mirror : mirrors_) {
    const float rays = rays_of(mirror, traced);
    const float of_all = rays * static_cast<float>(kSets) / static_cast<float>(traced);
    mirror.makes_image = rays > 0 && (mirror.makes_image || of_all >= kRaysOfImage);
  }
}

}  // namespace clamor
