// bake_check.h: validates contents before they are written to a bake file.
#pragma once

#include "common/result.h"

namespace clamor {

struct BakeContents;

// Checks what the readers of pages, signals and geometry require: finite values in range and valid
// indices. bake_root_reader.h checks the root. The Error is a clause: "source 7 has a negative
// power".
Result<void> check_bake(const BakeContents& contents);

}  // namespace clamor
