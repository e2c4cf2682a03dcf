#include "tools/view/window/scene_renderer.h"

#include <array>
#include <cmath>

#include <GL/gl.h>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "tools/view/window/scene_shaders.h"

namespace clamor {

namespace {

Result<unsigned> shader_of(unsigned kind, const char* text) {
  const unsigned shader = glCreateShader(kind);
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  int compiled = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled != 0) return shader;
  std::array<char, 1000> log{};
  glGetShaderInfoLog(shader, static_cast<int>(log.size()), nullptr, log.data());
  glDeleteShader(shader);
  return Error(std::string("the graphics driver refuses a shader: ") + log.data());
}

Result<void> make_program(unsigned& program, const char* vertex, const char* fragment,
                          const char* geometry = nullptr) {
  program = glCreateProgram();
  const std::array<std::pair<unsigned, const char*>, 3> stages{
      {{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}, {GL_GEOMETRY_SHADER, geometry}}};
  for (const auto& [kind, text] : stages) {
    if (text == nullptr) continue;
    const auto shader = shader_of(kind, text);
    if (!shader.ok()) return shader.error();
    glAttachShader(program, *shader);
    glDeleteShader(*shader);  // with the program
  }
  glLinkProgram(program);
  int linked = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  if (linked == 0) return Error("the graphics driver does not link a shader program");
  return {};
}

struct PointVertex {
  Vec3f position_m;
  std::array<float, 4> colour;
  float size, hollow;
};

// Floats at `first` in vertices of `stride` floats.
void attribute(unsigned index, int count, std::size_t stride, std::size_t first) {
  glEnableVertexAttribArray(index);
  glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, static_cast<int>(stride * sizeof(float)),
                        reinterpret_cast<const void*>(first * sizeof(float)));
}

template <class T>
void upload(unsigned buffer, std::span<const T> vertices, unsigned usage) {
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size_bytes()), vertices.data(),
               usage);
}

void make(unsigned& array, unsigned& buffer) {
  glGenVertexArrays(1, &array);
  glGenBuffers(1, &buffer);
  glBindVertexArray(array);
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
}

glm::mat4 projection_of(const WalkCamera& camera, double aspect) {
  const Listener at = camera.listener();
  const glm::mat4 view =
      glm::lookAt(Vec3f(at.position_m), Vec3f(at.position_m + at.forward()), Vec3f(at.up()));
  return glm::perspective(static_cast<float>(WalkCamera::kFieldOfView_rad),
                          static_cast<float>(aspect), 0.03f, 2000.0f) *
         view;
}

void set_matrix(unsigned program, const glm::mat4& projection) {
  glUseProgram(program);
  glUniformMatrix4fv(glGetUniformLocation(program, "projection"), 1, GL_FALSE,
                     glm::value_ptr(projection));
}

// Direct sound is amber, early reflections are teal, late ones slate.
std::array<float, 3> colour_of(SoundPart part) {
  switch (part) {
    case SoundPart::kDirect:
      return {1.0f, 0.72f, 0.30f};
    case SoundPart::kEarly:
      return {0.36f, 0.82f, 0.74f};
    case SoundPart::kLate:
      break;
  }
  return {0.62f, 0.70f, 0.92f};
}

}  // namespace

Result<std::unique_ptr<SceneRenderer>> SceneRenderer::create() {
  std::unique_ptr<SceneRenderer> renderer(new SceneRenderer());
  if (auto built = renderer->build(); !built.ok()) return built.error();
  return renderer;
}

Result<void> SceneRenderer::build() {
  Result<void> made = make_program(level_program_, kLevelVertex, kLevelFragment);
  if (made.ok()) made = make_program(line_program_, kLineVertex, kLineFragment, kLineGeometry);
  if (made.ok()) made = make_program(point_program_, kPointVertex, kPointFragment);
  if (!made.ok()) return made;

  constexpr std::size_t kLevelFloats = sizeof(ShadedVertex) / sizeof(float);
  static_assert(kLevelFloats == 10);
  for (Triangles* const triangles : {&level_, &parts_}) {
    make(triangles->array, triangles->buffer);
    attribute(0, 3, kLevelFloats, 0);
    attribute(1, 3, kLevelFloats, 3);
    attribute(2, 3, kLevelFloats, 6);
    attribute(3, 1, kLevelFloats, 9);
  }
  make(line_array_, line_buffer_);
  attribute(0, 3, 3, 0);
  make(point_array_, point_buffer_);
  constexpr std::size_t kPointFloats = sizeof(PointVertex) / sizeof(float);
  static_assert(kPointFloats == 9);
  attribute(0, 3, kPointFloats, 0);
  attribute(1, 4, kPointFloats, 3);
  attribute(2, 1, kPointFloats, 7);
  attribute(3, 1, kPointFloats, 8);
  glBindVertexArray(0);
  return {};
}

SceneRenderer::~SceneRenderer() {
  for (const unsigned array : {level_.array, parts_.array, line_array_, point_array_})
    glDeleteVertexArrays(1, &array);
  for (const unsigned buffer : {level_.buffer, parts_.buffer, line_buffer_, point_buffer_})
    glDeleteBuffers(1, &buffer);
  for (const unsigned program : {level_program_, line_program_, point_program_})
    glDeleteProgram(program);
}

void SceneRenderer::Triangles::set(std::span<const ShadedVertex> from, unsigned usage) {
  upload(buffer, from, usage);
  vertices = static_cast<int>(from.size());
}

void SceneRenderer::set_level(std::span<const ShadedVertex> vertices) {
  level_.set(vertices, GL_STATIC_DRAW);
}

void SceneRenderer::set_parts(std::span<const ShadedVertex> vertices) {
  parts_.set(vertices, GL_DYNAMIC_DRAW);
}

void SceneRenderer::set_lines(std::span<const SceneLines> lines) {
  std::vector<Vec3f> ends;
  lines_.clear();
  for (const SceneLines& one : lines) {
    lines_.push_back(
        {one.colour, static_cast<int>(ends.size()), static_cast<int>(one.ends.size())});
    ends.insert(ends.end(), one.ends.begin(), one.ends.end());
  }
  upload(line_buffer_, std::span<const Vec3f>(ends), GL_DYNAMIC_DRAW);
}

void SceneRenderer::draw(const ViewPort& port, const Scene& scene) {
  if (port.width <= 0 || port.height <= 0) return;
  glViewport(port.x, port.y, port.width, port.height);
  glScissor(port.x, port.y, port.width, port.height);
  glEnable(GL_SCISSOR_TEST);
  glClearColor(0.075f, 0.082f, 0.094f, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  const glm::mat4 projection = projection_of(scene.camera, port.aspect());

  set_matrix(level_program_, projection);
  const Vec3f eye(scene.camera.listener().position_m);
  glUniform3fv(glGetUniformLocation(level_program_, "eye"), 1, glm::value_ptr(eye));
  glUniform1f(glGetUniformLocation(level_program_, "selected"),
              static_cast<float>(scene.selected_material));
  for (const Triangles* const triangles : {&level_, &parts_}) {
    glBindVertexArray(triangles->array);
    glDrawArrays(GL_TRIANGLES, 0, triangles->vertices);
  }

  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(GL_FALSE);

  // What lies behind a wall is drawn faintly.
  set_matrix(line_program_, projection);
  const float half_px = 1.25f * scene.scale;
  glUniform2f(glGetUniformLocation(line_program_, "half_width"),
              2 * half_px / static_cast<float>(port.width),
              2 * half_px / static_cast<float>(port.height));
  glBindVertexArray(line_array_);
  for (const bool is_behind : {true, false}) {
    glDepthFunc(is_behind ? GL_GREATER : GL_LEQUAL);
    for (const Lines& lines : lines_) {
      glUniform4f(glGetUniformLocation(line_program_, "colour"), lines.colour.r, lines.colour.g,
                  lines.colour.b, is_behind ? 0.18f : 1.0f);
      glDrawArrays(GL_LINES, lines.first, lines.count);
    }
  }

  std::vector<PointVertex> points;
  points.reserve(scene.voices.size());
  for (const VoicePoint& voice : scene.voices) {
    const auto [r, g, b] = colour_of(voice.part);
    const float alpha = voice.opacity * (voice.is_hidden ? 0.5f : 0.5f + 0.5f * voice.loudness);
    points.push_back({voice.position_m,
                      {r, g, b, alpha},
                      scene.scale * (6 + 14 * voice.loudness * voice.loudness),
                      voice.is_hidden ? 1.0f : 0.0f});
  }
  upload(point_buffer_, std::span<const PointVertex>(points), GL_STREAM_DRAW);
  set_matrix(point_program_, projection);
  glEnable(GL_PROGRAM_POINT_SIZE);
  glBindVertexArray(point_array_);
  for (const bool is_behind : {true, false}) {
    glDepthFunc(is_behind ? GL_GREATER : GL_LEQUAL);
    glUniform1f(glGetUniformLocation(point_program_, "strength"), is_behind ? 0.22f : 1.0f);
    glDrawArrays(GL_POINTS, 0, static_cast<int>(points.size()));
  }
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
  glBindVertexArray(0);
  glDisable(GL_SCISSOR_TEST);
}

}  // namespace clamor
