// bake_root_findings.h: what the bake found in its level, in the root of a bake file.
//
// Internal to the files that read and write the root.
#pragma once

#include "common/result.h"
#include "formats/bake_file/bake_root.capnp.h"
#include "formats/bake_file/level_findings.h"

namespace clamor {

// Leaves out kinds of findings that it does not know. The Error is a clause.
Result<LevelFindings> read_findings(BakeRoot::Reader root);

// Writes sizes, places and directions that a file cannot hold as unknown ones, so that no finding
// makes a file unreadable.
void write_findings(BakeRoot::Builder root, const LevelFindings& findings);

}  // namespace clamor
