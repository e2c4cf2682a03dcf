// bake_root_values.h: bands and texts in the root of a bake file.
//
// Internal to the files that read and write the root.
#pragma once

#include <string>

#include "common/bands.h"
#include "common/result.h"
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

inline std::string text(capnp::Text::Reader reader) { return {reader.begin(), reader.size()}; }

template <class List>
void write_bands(List list, const Bands& bands) {
  for (unsigned b = 0; b < kBandCount; ++b) list.set(b, bands[b]);
}

}  // namespace clamor::bake_root
