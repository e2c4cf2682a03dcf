// bake_root_emitters.h: the emitter table in the root of a bake file.
//
// Internal to the files that read and write the root. emitter_table.h compresses the table.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/bake_root.capnp.h"
#include "formats/level/emitter.h"

namespace clamor {

struct BakeContents;

// Reads, expands and validates the table of a file with `file_bytes` bytes before its root. The
// Error is a clause: "emitter 'x' is out of range".
Result<std::vector<Emitter>> read_emitter_table(
    BakeRoot::Reader root, std::span<const std::vector<std::uint32_t>> signal_maps,
    std::uint64_t file_bytes);

void write_emitter_table(BakeRoot::Builder root, const BakeContents& contents,
                         std::uint64_t file_bytes);

}  // namespace clamor
