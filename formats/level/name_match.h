// name_match.h: matches names of people and exporters with known names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace clamor {

// Matches a whole name with a glob: * is any run of characters, ? any one. Ignores ASCII case. The
// worst case takes time proportional to the product of the lengths.
bool glob_matches(std::string_view pattern, std::string_view name);

// The letters of a name in UTF-8, without case and accents, and where its words begin.
// "m_WallBrick.02" is "mwallbrick" with words at 0, 1 and 5; "Dämmung" is "dammung". In scripts
// without spaces (Chinese, Japanese, Korean) each character is a word of its own.
struct NameLetters {
  std::string letters;
  std::vector<bool> begins;  // one more than letters; the end counts as the beginning of a word
};
NameLetters letters_of(std::string_view name);

}  // namespace clamor
