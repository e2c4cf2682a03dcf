// bake_check.h: whether contents can be a bake file, before any of it is packed.
#pragma once

#include "common/result.h"
#include "formats/bake_file/bake_file.h"

namespace clamor {

// What the pages, the signals and the geometry must hold for their readers to take them: numbers
// that are numbers and in range, indices that exist. The root is checked by bake_root_reader.h. An
// Error is half a sentence: "source 7 has a negative power".
Result<void> check_bake(const BakeContents& contents);

}  // namespace clamor
