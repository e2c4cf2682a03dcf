#include "tools/view/window/scene_renderer.h"

#include <array>
#include <cmath>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "tools/view/window/gl.h"

namespace clamor {

namespace {

constexpr const char* kLevelVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 colour;
layout(location = 3) in float material;
uniform mat4 projection;
uniform vec3 eye;
uniform float selected;
out vec3 from_eye;
flat out vec3 face_normal;
flat out vec3 face_colour;
flat out float is_selected;
void main() {
  from_eye = position - eye;
  face_normal = normal;
  face_colour = colour;
  is_selected = abs(material - selected) < 0.5 ? 1.0 : 0.0;
  gl_Position = projection * vec4(position, 1.0);
}
)";

// A sky light from above and a lamp at the eye, so that every wall has a shade of its own.
constexpr const char* kLevelFragment = R"(#version 330 core
in vec3 from_eye;
flat in vec3 face_normal;
flat in vec3 face_colour;
flat in float is_selected;
out vec4 result;
void main() {
  vec3 n = normalize(face_normal);
  float distance_m = length(from_eye);
  if (dot(n, from_eye) > 0.0) n = -n;
  float lamp = max(dot(n, -from_eye / max(distance_m, 1e-3)), 0.0);
  float sky = 0.5 + 0.5 * n.y;
  float side = 0.08 * n.x - 0.05 * n.z;
  float light = 0.26 + 0.22 * sky + 0.40 * lamp + side;
  light *= mix(1.0, 0.62, smoothstep(4.0, 60.0, distance_m));
  vec3 colour = face_colour * light;
  colour = mix(colour, vec3(0.86, 0.48, 0.16) * (0.35 + 0.65 * light), 0.22 * is_selected);
  result = vec4(pow(colour, vec3(1.0 / 2.2)), 1.0);
}
)";

constexpr const char* kLineVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
uniform mat4 projection;
void main() {
  gl_Position = projection * vec4(position, 1.0);
  gl_Position.z -= 0.0005 * gl_Position.w;  // in front of the wall that it belongs to
}
)";

// Lines of any width are rectangles.
constexpr const char* kLineGeometry = R"(#version 330 core
layout(lines) in;
layout(triangle_strip, max_vertices = 4) out;
uniform vec2 half_width;
void main() {
  vec4 a = gl_in[0].gl_Position, b = gl_in[1].gl_Position;
  const float near = 0.02;
  if (a.w < near && b.w < near) return;
  if (a.w < near) a = mix(b, a, (b.w - near) / (b.w - a.w));
  if (b.w < near) b = mix(a, b, (a.w - near) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) / half_width;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x) * half_width, ahead = along * half_width;
  gl_Position = a + vec4((across - ahead) * a.w, 0.0, 0.0); EmitVertex();
  gl_Position = a + vec4((-across - ahead) * a.w, 0.0, 0.0); EmitVertex();
  gl_Position = b + vec4((across + ahead) * b.w, 0.0, 0.0); EmitVertex();
  gl_Position = b + vec4((-across + ahead) * b.w, 0.0, 0.0); EmitVertex();
  EndPrimitive();
}
)";

constexpr const char* kLineFragment = R"(#version 330 core
uniform vec4 colour;
out vec4 result;
void main() { result = colour; }
)";

constexpr const char* kPointVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 colour;
layout(location = 2) in float size;
layout(location = 3) in float hollow;
uniform mat4 projection;
out vec4 point_colour;
out float point_size;
out float is_hollow;
void main() {
  gl_Position = projection * vec4(position, 1.0);
  gl_Position.z -= 0.0003 * gl_Position.w;
  gl_PointSize = size;
  point_colour = colour;
  point_size = size;
  is_hollow = hollow;
}
)";

constexpr const char* kPointFragment = R"(#version 330 core
in vec4 point_colour;
in float point_size;
in float is_hollow;
uniform float strength;
out vec4 result;
void main() {
  float r = length(gl_PointCoord - vec2(0.5)) * point_size;
  float outside = point_size * 0.5 - r;
  float alpha = clamp(outside, 0.0, 1.0);
  // A dark rim sets points off from bright walls.
  float inside = clamp(outside - 1.2, 0.0, 1.0);
  vec3 colour = mix(vec3(0.06), point_colour.rgb, inside);
  if (is_hollow > 0.5) alpha *= clamp(3.2 - outside, 0.0, 1.0);
  result = vec4(colour, point_colour.a * alpha * strength);
}
)";

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

Result<unsigned> program_of(const char* vertex, const char* fragment,
                            const char* geometry = nullptr) {
  const unsigned program = glCreateProgram();
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
  return program;
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
  const auto level = program_of(kLevelVertex, kLevelFragment);
  if (!level.ok()) return level.error();
  level_program_ = *level;
  const auto line = program_of(kLineVertex, kLineFragment, kLineGeometry);
  if (!line.ok()) return line.error();
  line_program_ = *line;
  const auto point = program_of(kPointVertex, kPointFragment);
  if (!point.ok()) return point.error();
  point_program_ = *point;

  make(level_array_, level_buffer_);
  constexpr std::size_t kLevelFloats = sizeof(ShadedVertex) / sizeof(float);
  static_assert(kLevelFloats == 10);
  attribute(0, 3, kLevelFloats, 0);
  attribute(1, 3, kLevelFloats, 3);
  attribute(2, 3, kLevelFloats, 6);
  attribute(3, 1, kLevelFloats, 9);
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
  for (const unsigned array : {level_array_, line_array_, point_array_})
    glDeleteVertexArrays(1, &array);
  for (const unsigned buffer : {level_buffer_, line_buffer_, point_buffer_})
    glDeleteBuffers(1, &buffer);
  for (const unsigned program : {level_program_, line_program_, point_program_})
    glDeleteProgram(program);
}

void SceneRenderer::set_level(std::span<const ShadedVertex> vertices) {
  glBindBuffer(GL_ARRAY_BUFFER, level_buffer_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size_bytes()), vertices.data(),
               GL_STATIC_DRAW);
  level_vertices_ = static_cast<int>(vertices.size());
}

void SceneRenderer::set_outline(std::span<const Vec3f> ends) {
  glBindBuffer(GL_ARRAY_BUFFER, line_buffer_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(ends.size_bytes()), ends.data(),
               GL_DYNAMIC_DRAW);
  line_vertices_ = static_cast<int>(ends.size());
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
  glBindVertexArray(level_array_);
  glDrawArrays(GL_TRIANGLES, 0, level_vertices_);

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
    glUniform4f(glGetUniformLocation(line_program_, "colour"), 1.0f, 0.62f, 0.18f,
                is_behind ? 0.18f : 1.0f);
    glDrawArrays(GL_LINES, 0, line_vertices_);
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
  glBindBuffer(GL_ARRAY_BUFFER, point_buffer_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(points.size() * sizeof(PointVertex)),
               points.data(), GL_STREAM_DRAW);
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
