#include "runtime/probes/part_images.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "formats/bake_file/page.h"
#include "runtime/propagation/received_intensity.h"
#include "runtime/propagation/source_number.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxOriginals = 64;
constexpr double kMaxDetour_m = 0.5;
constexpr double kMinHeight_m = 1e-3;
constexpr double kMaxStep_s = 0.1;  // between keyframes, for velocities
constexpr double kMaxSpeed_mps = 100;

}  // namespace

PartImages::PartImages(const PartScene& scene, std::span<const Emitter> emitters,
                       const RadiationModel& radiation, const SignalWeights& weights,
                       const MovingSourceList* moving)
    : ImagePool(moving), scene_(scene), radiation_(radiation) {
  for (std::size_t e = 0; e < emitters.size(); ++e) {
    Original& emitter = emitters_.emplace_back();
    emitter.source.emitter = static_cast<std::uint32_t>(e);
    set_from_emitter(emitter.source, emitters[e]);
    emitter.place_m = Vec3(emitter.source.position_m);
    const RadiationModel::UpperBound bound =
        radiation.upper_bound(emitter.source, weights.max(radiation.signal(emitter.source)));
    emitter.at_1m = kFloatSlack * static_cast<double>(bound.diffuse + bound.lobe);
  }
}

void PartImages::begin(const QueryKeyframe& keyframe) {
  last_s_ = this->keyframe().time_s;
  SourcePool::begin(keyframe);
  if (scene_.empty() && images_.empty()) return;
  before_.clear();
  for (const Image& image : images_)
    if (image.found.source != nullptr)
      before_.push_back({image.found.voice, image.part_version, Vec3(image.source.position_m)});
  images_.clear();
  list_faces();
  if (faces_.empty()) return;
  list_originals();
  for (const Original& original : originals_)
    for (const Face& face : faces_) add_image(original, face);
  if (images_.size() <= kMaxImages) return;
  std::ranges::nth_element(images_, images_.begin() + kMaxImages, std::greater<>(),
                           [](const Image& image) { return image.found.upper_bound; });
  images_.resize(kMaxImages);
}

void PartImages::take_over_parts() {
  if (scene_.version() == parts_version_) return;
  parts_version_ = scene_.version();
  all_faces_.clear();
  std::vector<PartShape::Face> of_part;
  for (std::size_t slot = 0; slot < scene_.slots(); ++slot) {
    of_part.clear();
    scene_.add_faces(slot, of_part);
    for (std::size_t f = 0; f < of_part.size(); ++f) {
      Face& face = all_faces_.emplace_back(Face{of_part[f]});
      face.slot = static_cast<std::uint32_t>(slot);
      face.index = static_cast<std::uint32_t>(f);
      face.version = scene_.version_of(slot);
    }
  }
}

void PartImages::list_faces() {
  take_over_parts();
  faces_.clear();
  for (const Face& face : all_faces_) {
    const double height = face.height_m(keyframe().place_m());
    if (std::abs(height) < kMinHeight_m || (height < 0 && face.is_outside)) continue;
    Face& before = faces_.emplace_back(face);
    before.to_listener_m = std::abs(height);
    if (height < 0) before.turn_round();
  }
}

void PartImages::list_originals() {
  originals_.clear();
  const auto add = [&](const Original& original) {
    if (!(original.at_1m > 0)) return;
    originals_.push_back(original);
    const double r_m = std::max(length(original.place_m - keyframe().place_m()), 1.0);
    originals_.back().loudness = original.at_1m / (r_m * r_m);
  };
  for (const Original& emitter : emitters_) add(emitter);
  for (std::uint32_t slot = 0; moving_ != nullptr && slot < moving_->slots(); ++slot)
    if (moving_->reverberation(slot) > 0)
      add({slot,
           {},
           moving_->place_m(slot),
           reflected_power(slot) * moving_->upper_bound_at_1m(slot)});
  if (originals_.size() <= kMaxOriginals) return;
  std::ranges::nth_element(originals_, originals_.begin() + kMaxOriginals, std::greater<>(),
                           &Original::loudness);
  originals_.resize(kMaxOriginals);
}

void PartImages::add_image(const Original& original, const Face& face) {
  const Vec3& place_m = keyframe().place_m();
  const double height = face.height_m(original.place_m);
  if (!(height > kMinHeight_m)) return;
  const Vec3 image_m = face.image_of(original.place_m);
  const double straight_m = length(image_m - place_m);
  // The point of the disc around the face that is next to where the straight path is reflected.
  const Vec3 from_centre_m =
      image_m + height / (height + face.to_listener_m) * (place_m - image_m) - face.centre_m;
  const double off_m = length(from_centre_m);
  const Vec3 at_m =
      face.centre_m + std::min(1.0, face.radius_m / std::max(off_m, 1e-9)) * from_centre_m;
  const double touching_m = length(original.place_m - at_m) + length(place_m - at_m);
  if (touching_m > straight_m + kMaxDetour_m) return;
  const double r_m = std::max(straight_m, kEmitterRadius_m);
  const double upper_bound = original.at_1m * static_cast<double>(face.reflected) / (r_m * r_m);
  const std::uint64_t number =
      original.slot ? moving_->number(*original.slot) : original.source.emitter;
  // Far from the numbers of probes' sources.
  const std::uint64_t reflection =
      (std::uint64_t{face.slot} << 8 | face.index) * 0xd6e8feb86659fd93u;
  Image& image = add(face, voice_number(number, reflection), upper_bound, original.slot);
  image.is_in_part = true;
  image.part_version = face.version;
  if (original.slot) return;
  image.source = original.source;
  image.found.signal = radiation_.signal(image.source);
}

// A part that moves takes its images along.
void PartImages::place(Image& image) {
  ImagePool::place(image);
  const auto before = std::ranges::find(before_, image.found.voice, &Before::voice);
  const double step_s = keyframe().time_s - last_s_;
  if (before == before_.end() || before->part_version == image.part_version ||
      !(step_s > 0 && step_s < kMaxStep_s))
    return;
  const Vec3 velocity_mps = (Vec3(image.source.position_m) - before->place_m) / step_s;
  if (length(velocity_mps) < kMaxSpeed_mps) image.found.velocity_mps = Vec3f(velocity_mps);
}

}  // namespace clamor
