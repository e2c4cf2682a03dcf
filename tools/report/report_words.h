// report_words.h: words that the sections of a report share.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/vec.h"
#include "formats/bake_file/bake_file.h"
#include "tools/analysis/room_parameters.h"

namespace clamor {

// Without folders.
std::string file_name(const BakeFile& file);

// "1.0, 1.7, -3.0".
std::string place_text(const Vec3& place_m);

// "Listener 1 at 1.0, 1.7, -3.0 m"; `index` counts from 0.
std::string listener_title(std::size_t index, const Vec3& place_m);

// "-" for none.
std::string value_text(const std::optional<double>& value, int digits);

// The titles of the octaves, after that of the first column.
std::vector<std::string> band_columns(const std::string& first);

// "T30 (s)".
std::string title_of(const ParameterKind& kind);

// The kind of that name, which must exist.
const ParameterKind& kind_of(const char* name);

}  // namespace clamor
