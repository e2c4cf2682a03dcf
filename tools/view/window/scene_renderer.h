// scene_renderer.h: draws the level, its movable parts, outlines and the chosen sources with
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

struct SceneLines {
  std::vector<Vec3f> ends;  // in pairs
  Vec3f colour;             // as it is shown, 0 to 1
};

class SceneRenderer {
 public:
  static Result<std::unique_ptr<SceneRenderer>> create();
  ~SceneRenderer();
  SceneRenderer(const SceneRenderer&) = delete;
  SceneRenderer& operator=(const SceneRenderer&) = delete;

  void set_level(std::span<const ShadedVertex> vertices);
  void set_parts(std::span<const ShadedVertex> vertices);
  // Later ones are drawn above earlier ones.
  void set_lines(std::span<const SceneLines> lines);

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

  struct Triangles {
    unsigned array = 0, buffer = 0;
    int vertices = 0;
    void set(std::span<const ShadedVertex> from, unsigned usage);
  };
  struct Lines {
    Vec3f colour;
    int first = 0, count = 0;
  };

  Triangles level_, parts_;
  std::vector<Lines> lines_;
  unsigned level_program_ = 0, line_program_ = 0, point_program_ = 0;
  unsigned line_array_ = 0, line_buffer_ = 0;
  unsigned point_array_ = 0, point_buffer_ = 0;
};

}  // namespace clamor
