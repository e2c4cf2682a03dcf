// image_pool.h: the images that a keyframe's sources have in planes.
//
// A listener hears the image of a moving source as the listener's own image hears the source. Upper
// bounds of all images are known when a keyframe begins; those that a query finds are placed.
//
// Threads: the sampler's alone.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "runtime/occlusion/mirror_plane.h"
#include "runtime/probes/first_reflections.h"
#include "runtime/query/source_pool.h"
#include "runtime/sampling/moving_source_list.h"

namespace clamor {

class ImagePool : public SourcePool {
 public:
  bool find_above(double threshold, std::size_t max_count,
                  std::vector<FoundSource>& found) override;
  double upper_bound() override;
  std::uint64_t size() const override { return images_.size(); }

 protected:
  struct Image {
    MirrorPlane plane;
    std::optional<std::uint32_t> slot;  // of its moving source; none: `source` is its emitter
    float u = 1;
    bool is_in_part = false;
    std::uint32_t part_version = 0;  // of the part that the plane is of
    Source source{};
    FoundSource found;  // its source is null until the image is placed
  };

  // `moving` may be null.
  explicit ImagePool(const MovingSourceList* moving) : moving_(moving) {}

  Image& add(const MirrorPlane& plane, std::uint64_t voice, double upper_bound,
             std::optional<std::uint32_t> slot);
  // The power factor of a moving source's reflections.
  double reflected_power(std::uint32_t slot) const {
    const auto gain = static_cast<double>(moving_->settings(slot).reverberation);
    return gain * gain;
  }
  virtual void place(Image& image);

  const MovingSourceList* const moving_;
  std::vector<Image> images_;  // of the keyframe
};

// The images of moving sources in the level's mirrors (source_mirrors.h).
class MirrorImages final : public ImagePool {
 public:
  // Begins a keyframe after the reflections and the moving sources have.
  MirrorImages(const FirstReflections& reflections, const MovingSourceList& moving)
      : ImagePool(&moving), reflections_(reflections) {}
  void begin(const QueryKeyframe& keyframe) override;

 private:
  const FirstReflections& reflections_;
};

}  // namespace clamor
