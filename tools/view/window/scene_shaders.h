// scene_shaders.h: the programs of scene_renderer.cpp for the graphics processor.
#pragma once

namespace clamor {

inline constexpr const char* kLevelVertex = R"(#version 330 core
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
inline constexpr const char* kLevelFragment = R"(#version 330 core
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

inline constexpr const char* kLineVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
uniform mat4 projection;
void main() {
  gl_Position = projection * vec4(position, 1.0);
  gl_Position.z -= 0.0005 * gl_Position.w;  // in front of the wall that it belongs to
}
)";

// Lines of any width are rectangles.
inline constexpr const char* kLineGeometry = R"(#version 330 core
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

inline constexpr const char* kLineFragment = R"(#version 330 core
uniform vec4 colour;
out vec4 result;
void main() { result = colour; }
)";

inline constexpr const char* kPointVertex = R"(#version 330 core
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

inline constexpr const char* kPointFragment = R"(#version 330 core
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

}  // namespace clamor
