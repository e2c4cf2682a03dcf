// name_match.h: names that people and exporters write, compared with names that we know.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace clamor {

// Whether all of `name` matches `pattern`: * is any run of characters, ? any one. Upper and lower
// case (of ASCII) are alike. Takes time in proportion to the product of the lengths at worst.
bool glob_matches(std::string_view pattern, std::string_view name);

// The words of a name as exporters write them, in lower case: "m_WallBrick.02" is m, wall, brick.
std::vector<std::string> words_of(std::string_view name);

}  // namespace clamor
