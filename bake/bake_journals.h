// bake_journals.h: opens the journals of a bake.
#pragma once

#include "bake/bake_options.h"
#include "bake/journal/journal_set.h"
#include "common/result.h"

namespace clamor {

struct Level;

// Opens the journal to append to, if any, followed by the shards.
Result<OpenJournals> open_journals(const Level& level, const BakeOptions& options);

}  // namespace clamor
