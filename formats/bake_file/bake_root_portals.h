// bake_root_portals.h: the portals in the root of a bake file.
//
// Internal to the files that read and write the root.
#pragma once

#include <cstddef>

#include "common/result.h"
#include "formats/bake_file/bake_root.capnp.h"
#include "formats/bake_file/baked_portals.h"

namespace clamor {

// `emitters`: their number in the file. The Error is a clause.
Result<BakedPortals> read_portals(BakeRoot::Reader root, std::size_t emitters,
                                  std::size_t movable_parts);

// Writes nothing if there are no portals.
void write_portals(BakeRoot::Builder root, const BakedPortals& portals);

// Checks rectangles, sets and virtual emitters. The Error is a clause.
Result<void> check_portals(const BakedPortals& portals, std::size_t emitters,
                           std::size_t movable_parts);

}  // namespace clamor
