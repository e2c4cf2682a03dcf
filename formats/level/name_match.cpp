#include "formats/level/name_match.h"

namespace clamor {

namespace {

// Independent of the locale, unlike <cctype>.
char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// Removes the first code point of a text. A byte that is no UTF-8 is a code point of its own.
char32_t take_point(std::string_view& text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  const std::size_t length = first < 0xc0 ? 1 : first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
  char32_t point = length == 1 ? first : first & (0x7fu >> length);
  bool whole = length <= text.size();
  for (std::size_t i = 1; i < length && whole; ++i) {
    whole = (byte(i) & 0xc0) == 0x80;
    point = point << 6 | (byte(i) & 0x3f);
  }
  text.remove_prefix(whole ? length : 1);
  return whole ? point : U' ';
}

bool is_upper(char32_t c) {
  return (c >= 'A' && c <= 'Z') || (c >= 0xc0 && c <= 0xde && c != 0xd7) ||
         (c >= 0x400 && c <= 0x42f);
}

// Scripts that are written without spaces, and Korean, whose words take endings.
bool has_no_spaces(char32_t c) {
  return (c >= 0x2e80 && c < 0x3000) || (c >= 0x3041 && c <= 0xd7ff && c != 0x30fb) ||
         (c >= 0xf900 && c <= 0xfaff) || (c >= 0xff66 && c <= 0xff9d) || c >= 0x20000;
}

std::string utf8(char32_t c) {
  const auto byte = [](char32_t bits) { return static_cast<char>(bits); };
  if (c < 0x80) return {byte(c)};
  if (c < 0x800) return {byte(0xc0 | c >> 6), byte(0x80 | (c & 0x3f))};
  if (c < 0x10000)
    return {byte(0xe0 | c >> 12), byte(0x80 | (c >> 6 & 0x3f)), byte(0x80 | (c & 0x3f))};
  return {byte(0xf0 | c >> 18), byte(0x80 | (c >> 12 & 0x3f)), byte(0x80 | (c >> 6 & 0x3f)),
          byte(0x80 | (c & 0x3f))};
}

// Base letters of U+00C0 to U+017F; upper-case letters stand for two.
constexpr std::string_view kLatin =
    "aaaaaaAceeeeiiiidnooooo-ouuuuyTSaaaaaaAceeeeiiiidnooooo-ouuuuyTy"
    "aaaaaaccccccccddddeeeeeeeeeegggggggghhhhiiiiiiiiiiiijjkkkllllllllllnnnnnnnnnooooooOOrrrrrr"
    "ssssssssttttttuuuuuuuuuuuuwwyyyzzzzzzs";

// The letters for which a code point stands, without case and accents; none if it is no letter.
std::string folded(char32_t c) {
  if (c < 0x80) {
    const char small = lower(static_cast<char>(c));
    return small >= 'a' && small <= 'z' ? std::string(1, small) : "";
  }
  if (c >= 0xff21 && c <= 0xff5a) return folded(c - 0xfee0);  // wide Latin letters
  if (c >= 0xc0 && c < 0x180) {
    switch (const char base = kLatin[c - 0xc0]) {
      case '-':
        return "";
      case 'A':
        return "ae";
      case 'O':
        return "oe";
      case 'S':
        return "ss";
      case 'T':
        return "th";
      default:
        return std::string(1, base);
    }
  }
  if (c == 0x401 || c == 0x451) return utf8(0x435);  // the Russian yo, which is often written ye
  if (c >= 0x410 && c <= 0x42f) return utf8(c + 0x20);
  if (c >= 0x400 && c <= 0x40f) return utf8(c + 0x50);
  if (c >= 0x391 && c <= 0x3a9) return utf8(c + 0x20);
  const bool is_letter =
      (c >= 0x370 && c < 0x2000) || (c >= 0x180 && c < 0x250) || has_no_spaces(c);
  return is_letter ? utf8(c) : "";
}

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

NameLetters letters_of(std::string_view name) {
  NameLetters result;
  bool in_word = false, after_upper = false;
  while (!name.empty()) {
    const char32_t point = take_point(name);
    if (point >= 0x300 && point <= 0x36f) continue;  // accents that stand alone
    const std::string letters = folded(point);
    if (letters.empty()) {
      in_word = false;
      continue;
    }
    // An upper-case letter after a lower-case one begins a word: wallBrick.
    const bool upper = is_upper(point);
    if (has_no_spaces(point) || (upper && !after_upper)) in_word = false;
    after_upper = upper;
    result.begins.push_back(!in_word);
    result.begins.resize(result.letters.size() + letters.size(), false);
    result.letters += letters;
    in_word = !has_no_spaces(point);
  }
  result.begins.push_back(true);
  return result;
}

}  // namespace clamor
