#include "formats/bake_file/bake_root_images.h"

#include <algorithm>
#include <cmath>

namespace clamor {

namespace {

constexpr double kFarthest_m = 4e6;  // twice as far as a level reaches

}  // namespace

Result<void> check_images(std::span<const ImageSource> images, std::size_t emitters) {
  if (images.size() > kMaxImages) return Error("it has more than 1048576 image sources");
  for (const ImageSource& image : images) {
    if (image.emitter >= emitters)
      return Error("an image source names an emitter that does not exist");
    const Vec3& at_m = image.position_m;
    if (!(std::max({std::abs(at_m.x), std::abs(at_m.y), std::abs(at_m.z)}) <= kFarthest_m))
      return Error("an image source lies outside the coordinate range");
    if (!(std::abs(length(image.axis) - 1) < 1e-3))
      return Error("the axis of an image source is no unit vector");
  }
  return {};
}

Result<std::vector<ImageSource>> read_images(BakeRoot::Reader root, std::size_t emitters) {
  std::vector<ImageSource> images;
  const auto stored = root.getImages();
  if (stored.size() > kMaxImages) return Error("it has more than 1048576 image sources");
  for (const auto one : stored)
    images.push_back({one.getEmitter(),
                      {one.getX(), one.getY(), one.getZ()},
                      {one.getAxisX(), one.getAxisY(), one.getAxisZ()}});
  if (const auto done = check_images(images, emitters); !done.ok()) return done.error();
  return images;
}

void write_images(BakeRoot::Builder root, std::span<const ImageSource> images) {
  if (images.empty()) return;
  auto list = root.initImages(static_cast<unsigned>(images.size()));
  for (unsigned i = 0; i < list.size(); ++i) {
    list[i].setEmitter(images[i].emitter);
    list[i].setX(images[i].position_m.x);
    list[i].setY(images[i].position_m.y);
    list[i].setZ(images[i].position_m.z);
    list[i].setAxisX(static_cast<float>(images[i].axis.x));
    list[i].setAxisY(static_cast<float>(images[i].axis.y));
    list[i].setAxisZ(static_cast<float>(images[i].axis.z));
  }
}

}  // namespace clamor
