#include "formats/level/name_match.h"

namespace clamor {

namespace {

// Independent of the locale, unlike <cctype>.
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_letter(char c) { return is_upper(c) || (c >= 'a' && c <= 'z') || (c & 0x80) != 0; }
char lower(char c) { return is_upper(c) ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

bool glob_matches(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0;
  std::size_t star = std::string_view::npos,
              retry = 0;  // positions after the last * and of its match end
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      retry = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || lower(pattern[p]) == lower(name[n]))) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++retry;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  bool in_word = false;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!is_letter(name[i])) {
      in_word = false;
      continue;
    }
    // An upper-case letter after a lower-case one begins a word: wallBrick.
    if (is_upper(name[i]) && i > 0 && !is_upper(name[i - 1])) in_word = false;
    if (!in_word) words.emplace_back();
    words.back() += lower(name[i]);
    in_word = true;
  }
  return words;
}

}  // namespace clamor
