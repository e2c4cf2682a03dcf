// text.h: the name somebody meant, and words in any case.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace clamor {

// The least number of letters to insert, drop or change that make a of b. Case (of ASCII)
// counts for nothing. Of what is longer than 64, the beginning. (V. Levenshtein, 1966.)
std::size_t edit_distance(std::string_view a, std::string_view b);

// The name nearest to `name`, the first of equals; empty when there are no names.
std::string nearest_name(std::string_view name, std::span<const std::string> names);

// Whether they are the same but for the case of ASCII letters, as units are.
bool equal_ignoring_case(std::string_view a, std::string_view b);

}  // namespace clamor
