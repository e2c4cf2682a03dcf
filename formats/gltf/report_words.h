// report_words.h: numbers and lists of things in the lines of an import report.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace clamor {

// "meshes", "skies", "lower levels of detail".
std::string plural_of(std::string_view thing);

// "1 mesh", "2 meshes".
std::string number_of(std::size_t count, std::string_view thing);

// " and 2 more"; empty for none.
std::string and_more(std::size_t count);

// "'a', 'b', 'c' and 2 more".
std::string first_names(const std::vector<std::string>& names);

}  // namespace clamor
