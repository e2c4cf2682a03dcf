// text.h: approximate and case-insensitive comparison of names.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace clamor {

// Levenshtein distance (V. Levenshtein, 1966), ignoring ASCII case. Compares at most the first 64
// letters of each.
std::size_t edit_distance(std::string_view a, std::string_view b);

// The name at the least edit distance from `name`, the first of equals; empty if `names` is.
std::string nearest_name(std::string_view name, std::span<const std::string> names);

// Compares two strings ignoring ASCII case, as for units.
bool equal_ignoring_case(std::string_view a, std::string_view b);

}  // namespace clamor
