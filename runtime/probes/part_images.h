// part_images.h: image sources of emitters and moving sources in the faces of movable parts.
//
// A closed door, a lift or a lorry reflects what arrives, as a mirror of the level does: the image
// of a source in the plane of a face (part_shape.h) is heard where its path meets the face, and
// around the face's edges (image_path.h). The plane is that of this keyframe, so an image follows
// its part as well as its source, with its own delay and Doppler shift. It has one reflection; what
// the face scatters is not heard.
//
// Only the 64 sources that are the loudest for the listener have images in parts, and of these
// images the 64 that can be the loudest count. An image is left out where its path would have to
// make a detour of more than half a metre to touch the disc around its face.
//
// Threads: the sampler's alone.   Cost: nothing without parts; 10 ns for each of these sources and
// each face that the listener is before.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/emitter.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/probes/image_pool.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_weights.h"

namespace clamor {

class PartImages final : public ImagePool {
 public:
  static constexpr std::size_t kMaxImages = 64;

  // `emitters` are those of the level. All arguments must outlive the object; `moving` may be null.
  PartImages(const PartScene& scene, std::span<const Emitter> emitters,
             const RadiationModel& radiation, const SignalWeights& weights,
             const MovingSourceList* moving);

  // Begins a keyframe, after `moving` has begun it.
  void begin(const QueryKeyframe& keyframe) override;
  std::uint64_t size() const override { return kMaxImages; }

 private:
  // A source that is heard directly: an emitter or, with a slot, a moving source.
  struct Original {
    std::optional<std::uint32_t> slot;
    Source source{};      // of an emitter
    Vec3 place_m{};       // now
    double at_1m = 0;     // upper bound of its priority
    double loudness = 0;  // of that, at the listener
  };
  // A face that the listener is before, with its normal towards the listener.
  struct Face : PartShape::Face {
    std::uint32_t slot = 0, index = 0, version = 0;  // its part, and that part's version
    double to_listener_m = 0;                        // from its plane
  };
  // Where an image was in the last keyframe.
  struct Before {
    std::uint64_t voice = 0;
    std::uint32_t part_version = 0;
    Vec3 place_m{};
  };

  void list_originals();
  void take_over_parts();
  void list_faces();
  void add_image(const Original& original, const Face& face);
  void place(Image& image) override;

  const PartScene& scene_;
  const RadiationModel& radiation_;
  std::vector<Original> emitters_;   // of the level
  std::vector<Original> originals_;  // of the keyframe
  std::vector<Face> faces_;          // likewise
  std::vector<Face> all_faces_;      // of the parts as they are
  std::uint64_t parts_version_ = 0;
  std::vector<Before> before_;
  double last_s_ = 0;  // of the last keyframe
};

}  // namespace clamor
