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
constexpr double kSlackOfBound = 1.00001;
constexpr double kMinHeight_m = 1e-3;
constexpr double kMaxStep_s = 0.1;  // between keyframes, for velocities
constexpr double kMaxSpeed_mps = 100;

}  // namespace

PartImages::PartImages(const PartScene& scene, std::span<const Emitter> emitters,
                       const RadiationModel& radiation, const SignalWeights& weights,
                       const MovingSourceList* moving)
    : scene_(scene), radiation_(radiation), moving_(moving) {
  for (std::size_t e = 0; e < emitters.size(); ++e) {
    Source& source = emitters_.emplace_back();
    source.emitter = static_cast<std::uint32_t>(e);
    set_from_emitter(source, emitters[e]);
    const RadiationModel::UpperBound bound =
        radiation.upper_bound(source, weights.max(radiation.signal(source)));
    emitters_at_1m_.push_back(kSlackOfBound * static_cast<double>(bound.diffuse + bound.lobe));
  }
}

void PartImages::begin(const Vec3& place_m, double time_s) {
  if (scene_.empty() && images_.empty()) return;
  before_.clear();
  for (const Image& image : images_)
    if (image.is_placed)
      before_.push_back({image.number, image.face.version, Vec3(image.source.position_m)});
  last_s_ = std::exchange(time_s_, time_s);
  place_m_ = place_m;
  images_.clear();
  list_faces();
  if (faces_.empty()) return;
  list_originals();
  for (std::uint32_t o = 0; o < originals_.size(); ++o)
    for (const Face& face : faces_) add_image(o, face);
  if (images_.size() <= kMaxImages) return;
  std::ranges::nth_element(images_, images_.begin() + kMaxImages, std::greater<>(),
                           &Image::upper_bound);
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
    const double height = face.height_m(place_m_);
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
    const double r_m = std::max(length(original.place_m - place_m_), 1.0);
    originals_.back().loudness = original.at_1m / (r_m * r_m);
  };
  for (std::size_t e = 0; e < emitters_.size(); ++e)
    add({false, static_cast<std::uint32_t>(e), Vec3(emitters_[e].position_m), emitters_at_1m_[e]});
  for (std::size_t slot = 0; moving_ != nullptr && slot < moving_->slots(); ++slot) {
    if (!(moving_->reverberation(slot) > 0)) continue;
    const auto gain = static_cast<double>(moving_->settings(slot).reverberation);
    add({true, static_cast<std::uint32_t>(slot), moving_->place_m(slot),
         gain * gain * moving_->upper_bound_at_1m(slot)});
  }
  if (originals_.size() <= kMaxOriginals) return;
  std::ranges::nth_element(originals_, originals_.begin() + kMaxOriginals, std::greater<>(),
                           &Original::loudness);
  originals_.resize(kMaxOriginals);
}

void PartImages::add_image(std::uint32_t o, const Face& face) {
  const Original& original = originals_[o];
  const double height = face.height_m(original.place_m);
  if (!(height > kMinHeight_m)) return;
  const Vec3 image_m = face.image_of(original.place_m);
  const double straight_m = length(image_m - place_m_);
  // The point of the disc around the face that is next to where the straight path is reflected.
  const Vec3 from_centre_m =
      image_m + height / (height + face.to_listener_m) * (place_m_ - image_m) - face.centre_m;
  const double off_m = length(from_centre_m);
  const Vec3 at_m =
      face.centre_m + std::min(1.0, face.radius_m / std::max(off_m, 1e-9)) * from_centre_m;
  const double touching_m = length(original.place_m - at_m) + length(place_m_ - at_m);
  if (touching_m > straight_m + kMaxDetour_m) return;
  const double r_m = std::max(straight_m, kEmitterRadius_m);
  const double upper_bound = original.at_1m * static_cast<double>(face.reflected) / (r_m * r_m);
  images_.push_back({o, face, 0, upper_bound});
}

void PartImages::find_above(double threshold, std::vector<FoundSource>& found) {
  for (Image& image : images_) {
    if (!(image.upper_bound > 0 && image.upper_bound >= threshold)) continue;
    if (!image.is_placed) place(image);
    const Original& original = originals_[image.original];
    FoundSource& one = found.emplace_back();
    one.source = &image.source;
    one.signal = radiation_.signal(image.source);
    one.voice = image.number;
    one.number = image.number ^ image.cell;
    one.velocity_mps = image.velocity_mps;
    one.start_s = original.is_moving ? moving_->start_s(original.index) : 0;
    one.upper_bound = image.upper_bound;
  }
}

void PartImages::place(Image& image) {
  const Original& original = originals_[image.original];
  const Face& face = image.face;
  const std::uint64_t of_original =
      original.is_moving ? moving_->number(original.index) : original.index;
  // Far from the numbers of probes' sources.
  image.number =
      voice_number(of_original, (std::uint64_t{face.slot} << 8 | face.index) * 0xd6e8feb86659fd93u);
  Source& source = image.source;
  if (original.is_moving) {
    const MovingSourceList::Heard heard =
        moving_->heard_at(original.index, face.image_of(place_m_));
    source = heard.source;
    image.velocity_mps = Vec3f(face.mirrored(Vec3(heard.velocity_mps)));
    image.cell = heard.cell;
    const float gain = moving_->settings(original.index).reverberation;
    for (float& power : source.power) power *= gain * gain;
  } else {
    source = emitters_[original.index];
  }
  source.u = 1;
  source.is_image = true;
  source.patch_radius_m = static_cast<float>(face.radius_m);
  source.mirror = source.position_m;
  source.position_m = Vec3f(face.image_of(Vec3(source.position_m)));
  source.normal = Vec3f(face.mirrored(Vec3(source.normal)));
  image.is_placed = true;
  // A part that moves takes its images along.
  const auto before = std::ranges::find(before_, image.number, &Before::number);
  const double step_s = time_s_ - last_s_;
  if (before == before_.end() || before->version == face.version ||
      !(step_s > 0 && step_s < kMaxStep_s))
    return;
  const Vec3 velocity_mps = (Vec3(source.position_m) - before->place_m) / step_s;
  if (length(velocity_mps) < kMaxSpeed_mps) image.velocity_mps = Vec3f(velocity_mps);
}

double PartImages::upper_bound() const {
  double highest = 0;
  for (const Image& image : images_) highest = std::max(highest, image.upper_bound);
  return highest;
}

}  // namespace clamor
