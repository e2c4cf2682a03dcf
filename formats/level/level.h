// level.h: a level as the bake wants it: triangles, materials, emitters and the signals they play.
//
// What a glTF file, its sidecar and the command line say has been merged; nothing here depends on
// where it came from. Metres, seconds, right-handed, +Y up. All values are finite and in range.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/air.h"
#include "common/bands.h"
#include "common/material.h"
#include "common/vec.h"

namespace clamor {

inline constexpr int kSampleRate_hz = 48000;  // of every signal, delay and mix

// A sound that emitters play, mono, at kSampleRate_hz, full scale 1.
struct Signal {
  std::string name;
  std::vector<float> samples;
  bool loop = true;  // or once, from time 0 of the emitter

  bool operator==(const Signal&) const = default;
};

// A place that plays a signal. Heard at 1 m on its axis with amplitude gain x signal.
struct Emitter {
  std::string name;
  Vec3 position_m{};
  Vec3 axis{0, 0, -1};  // unit; the directivity's 0 degrees
  double gain = 1;      // amplitude at 1 m on axis
  Bands directivity{};  // exponent p of ((1 + cos a) / 2)^p per band, 0 = omnidirectional
  std::uint32_t signal = 0;
  double delay_s = 0;  // how much later than time 0 it starts its signal; a phase when it loops

  bool operator==(const Emitter&) const = default;
};

// Triangles that reflect on both sides.
struct Mesh {
  std::vector<Vec3f> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices into vertices_m
  std::vector<std::uint16_t> materials;                 // per triangle, index into Level::materials

  bool operator==(const Mesh&) const = default;
};

struct Level {
  std::string name;  // the file's name without its folder
  Mesh mesh;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<Signal> signals;
  Air air{};
};

}  // namespace clamor
