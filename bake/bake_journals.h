// bake_journals.h: opens the journals of a bake.
#pragma once

#include <cstddef>

#include "bake/bake_options.h"
#include "bake/journal/journal_set.h"
#include "common/result.h"

namespace clamor {

// Opens the journal to append to, if any, followed by the shards: all of a level with that many
// materials of deposits and portals.
Result<OpenJournals> open_journals(std::size_t materials, std::size_t portals,
                                   const BakeOptions& options);

}  // namespace clamor
