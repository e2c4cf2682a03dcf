// bake_arguments.h: the options of a bake as words, on the command line and in the note of a shard;
// shared by clamor bake and clamor merge.
#pragma once

#include <optional>
#include <string>

#include "bake/bake_request.h"
#include "tools/program/arguments.h"

namespace clamor {

// The options of reading a level, which add_bake_options() adds as well.
void add_import_options(Arguments& parser, ImportOptions& options);
void add_bake_options(Arguments& parser, BakeRequest& request);

// Level path and words in one string, which a shard stores so that it can be merged; and back.
std::string note_of(const BakeRequest& request);
std::optional<BakeRequest> request_from_note(const std::string& note);

}  // namespace clamor
