// level_inspection.h: what a bake would take a level file for, without baking it.
#pragma once

#include <iosfwd>
#include <string>

#include "common/result.h"
#include "formats/gltf/import_options.h"
#include "formats/gltf/import_report.h"

namespace clamor {

// Whether the file is glTF rather than a bake, by its first bytes or its name.
bool is_level_file(const std::string& path);

// Prints the lines of an import as `clamor bake` does, without the warnings.
void print_import(const std::string& level, const ImportReport& report, std::ostream& out);

// Reads and prepares a level, and prints what was found, every rule for what is no surface with
// what it leaves out, and the warnings.
Result<void> inspect_level(const std::string& path, const ImportOptions& options, bool json,
                           std::ostream& out);

}  // namespace clamor
