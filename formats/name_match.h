// name_match.h: names that people and exporters write, compared with names that we know.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace clamor {

// Whether all of `name` matches `pattern`: * is any run of characters, ? any one. Upper and lower
// case (of ASCII) are alike. Takes time in proportion to the product of the lengths at worst.
bool glob_matches(std::string_view pattern, std::string_view name);

// The candidate that takes the fewest insertions, deletions and changes of a character to get
// from `name`; the first of equals; empty where there are no candidates.
std::string nearest_name(std::string_view name, std::span<const std::string> candidates);

// The words of a name as exporters write them, in lower case: "m_WallBrick.02" is m, wall, brick.
std::vector<std::string> words_of(std::string_view name);

}  // namespace clamor
