// bake_root_values.h: bands, points and texts in the root of a bake file.
//
// Internal to the files that read and write the root.
#pragma once

#include <string>

#include "common/bands.h"
#include "common/name_length.h"
#include "common/result.h"
#include "common/vec.h"
#include "formats/bake_file/bake_root.capnp.h"

namespace clamor::bake_root {

// Reads eight values in [min, max], or returns an Error.
template <class List>
Result<Bands> read_bands(const List& list, float min, float max, const std::string& what) {
  Bands bands{};
  if (list.size() != kBandCount) return Error(what + " has not eight bands");
  for (unsigned b = 0; b < kBandCount; ++b) {
    bands[b] = list[b];
    if (!(bands[b] >= min && bands[b] <= max)) return Error(what + " is out of range");
  }
  return bands;
}

// Reads x, y and z, or returns an Error.
template <class List>
Result<Vec3> read_vector(const List& list, const std::string& what) {
  if (list.size() != 3) return Error(what + " has a point without three coordinates");
  return Vec3(list[0], list[1], list[2]);
}

template <class List>
void write_vector(List list, const Vec3& vector) {
  for (unsigned axis = 0; axis < 3; ++axis) list.set(axis, vector[static_cast<int>(axis)]);
}

// A sentence, path or argument, at most kMaxTextBytes long.
inline std::string text(capnp::Text::Reader reader, std::size_t most = kMaxTextBytes) {
  std::string text(reader.begin(), reader.size());
  shorten(text, most);
  return text;
}

inline std::string name(capnp::Text::Reader reader) { return text(reader, kMaxNameBytes); }

template <class List>
void write_bands(List list, const Bands& bands) {
  for (unsigned b = 0; b < kBandCount; ++b) list.set(b, bands[b]);
}

}  // namespace clamor::bake_root
