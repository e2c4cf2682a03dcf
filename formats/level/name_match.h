// name_match.h: matches names of people and exporters with known names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace clamor {

// Matches a whole name with a glob: * is any run of characters, ? any one. Ignores ASCII case. The
// worst case takes time proportional to the product of the lengths.
bool glob_matches(std::string_view pattern, std::string_view name);

// Splits a name into lower-case words: "m_WallBrick.02" is m, wall, brick.
std::vector<std::string> words_of(std::string_view name);

}  // namespace clamor
