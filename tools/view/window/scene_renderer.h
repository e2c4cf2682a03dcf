// scene_renderer.h: draws the level, the outline of the selection and the chosen sources with
// OpenGL.
//
// Threads: that of the OpenGL context, which must be current, also for the destructor.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/view/level_shapes.h"
#include "tools/view/voice_display.h"
#include "tools/view/walk_camera.h"

namespace clamor {

// A rectangle of the window in pixels, from its lower left corner.
struct ViewPort {
  int x = 0, y = 0, width = 0, height = 0;
  double aspect() const { return height > 0 ? static_cast<double>(width) / height : 1; }
};

class SceneRenderer {
 public:
  static Result<std::unique_ptr<SceneRenderer>> create();
  ~SceneRenderer();
  SceneRenderer(const SceneRenderer&) = delete;
  SceneRenderer& operator=(const SceneRenderer&) = delete;

  void set_level(std::span<const ShadedVertex> vertices);
  // Pairs of points; none: nothing is selected.
  void set_outline(std::span<const Vec3f> ends);

  struct Scene {
    const WalkCamera& camera;
    std::span<const VoicePoint> voices;
    int selected_material = -1;  // is tinted
    float scale = 1;             // of points and lines
  };
  void draw(const ViewPort& port, const Scene& scene);

 private:
  SceneRenderer() = default;
  Result<void> build();

  unsigned level_program_ = 0, line_program_ = 0, point_program_ = 0;
  unsigned level_array_ = 0, level_buffer_ = 0;
  unsigned line_array_ = 0, line_buffer_ = 0;
  unsigned point_array_ = 0, point_buffer_ = 0;
  int level_vertices_ = 0, line_vertices_ = 0;
};

}  // namespace clamor
