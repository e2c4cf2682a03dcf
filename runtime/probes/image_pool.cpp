#include "runtime/probes/image_pool.h"

#include <algorithm>

#include "runtime/propagation/source_number.h"

namespace clamor {

ImagePool::Image& ImagePool::add(const MirrorPlane& plane, std::uint64_t voice, double upper_bound,
                                 std::optional<std::uint32_t> slot) {
  Image& image = images_.emplace_back();
  image.plane = plane;
  image.slot = slot;
  image.found.number = image.found.voice = voice;
  image.found.upper_bound = upper_bound;
  if (slot) {
    image.found.signal = moving_->signal(*slot);
    image.found.start_s = moving_->start_s(*slot);
  }
  return image;
}

bool ImagePool::find_above(double threshold, std::size_t /*max_count*/,
                           std::vector<FoundSource>& found) {
  for (Image& image : images_) {
    if (!(image.found.upper_bound > 0 && image.found.upper_bound >= threshold)) continue;
    if (image.found.source == nullptr) place(image);
    image.found.source = &image.source;
    found.push_back(image.found);
    spend(WorkBudget::kFound);
  }
  return true;
}

double ImagePool::upper_bound() {
  double highest = 0;
  for (const Image& image : images_) highest = std::max(highest, image.found.upper_bound);
  return highest;
}

void ImagePool::place(Image& image) {
  const MirrorPlane& plane = image.plane;
  Source& source = image.source;
  if (image.slot) {
    const MovingSourceList::Heard heard =
        moving_->heard_at(*image.slot, plane.image_of(keyframe().place_m()));
    source = heard.source;
    const float gain = moving_->settings(*image.slot).reverberation;
    for (float& power : source.power) power *= gain * gain;
    image.found.velocity_mps = Vec3f(plane.mirrored(Vec3(heard.velocity_mps)));
    image.found.number ^= heard.cell;
  }
  source.u = image.u;
  source.is_image = true;
  source.is_in_part = image.is_in_part;
  source.original_m = source.position_m;
  source.position_m = Vec3f(plane.image_of(Vec3(source.position_m)));
  source.normal = Vec3f(plane.mirrored(Vec3(source.normal)));
}

// A listener behind the mirror does not hear the image.
void MirrorImages::begin(const QueryKeyframe& keyframe) {
  SourcePool::begin(keyframe);
  images_.clear();
  const Vec3& place_m = keyframe.place_m();
  reflections_.for_each_image([&](std::uint32_t slot, const SourceMirrors::Mirror& mirror) {
    if (dot(mirror.plane.normal, place_m) <= mirror.plane.offset_m) return;
    const double upper_bound = reflected_power(slot) * static_cast<double>(mirror.reflected) *
                               moving_->upper_bound_times_u(slot, mirror.plane.image_of(place_m)) /
                               static_cast<double>(std::max(mirror.u, kMinU));
    const std::uint64_t voice = voice_number(moving_->number(slot), kFirstImage + mirror.number);
    add(mirror.plane, voice, upper_bound, slot).u = mirror.u;
  });
}

}  // namespace clamor
