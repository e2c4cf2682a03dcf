#include "common/printable.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace clamor {

namespace {

constexpr char32_t kInvalid = 0xffffffff;

// A decoded UTF-8 character, or one invalid byte.
struct Character {
  char32_t code = kInvalid;
  std::size_t bytes = 1;
};

// Length in bytes of the character that starts with this byte; 0 if none can.
std::size_t length_from(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first < 0xe0) return 2;
  if (first >= 0xe0 && first < 0xf0) return 3;
  if (first >= 0xf0 && first < 0xf5) return 4;
  return 0;
}

// Lowest code point that needs this many bytes.
constexpr std::array<char32_t, 5> kMinCode = {0, 0, 0x80, 0x800, 0x10000};

Character next_of(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  const std::size_t length = length_from(first);
  if (length == 1) return {first, 1};
  if (length == 0 || text.size() < length) return {};
  char32_t code = first & (0x7fu >> length);
  for (std::size_t i = 1; i < length; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xc0) != 0x80) return {};
    code = code << 6 | (byte & 0x3fu);
  }
  const bool is_surrogate = code >= 0xd800 && code < 0xe000;
  if (code < kMinCode[length] || code > 0x10ffff || is_surrogate) return {};
  return {code, length};
}

bool is_shown(char32_t code) {
  const auto within = [code](char32_t first, char32_t last) {
    return code >= first && code <= last;
  };
  return code != kInvalid && code >= 0x20 && !within(0x7f, 0x9f) &&  // C0, delete, C1
         code != 0x061c && !within(0x200e, 0x200f) && !within(0x202a, 0x202e) &&
         !within(0x2066, 0x2069) &&  // bidirectional
         !within(0x2028, 0x2029);    // line and paragraph separators
}

// Copies printable characters and calls replace(code, out) for the others.
template <class Replace>
std::string with_replaced(std::string_view text, const Replace& replace) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Character one = next_of(text);
    if (is_shown(one.code))
      out.append(text.substr(0, one.bytes));
    else
      replace(one.code, out);
    text.remove_prefix(one.bytes);
  }
  return out;
}

}  // namespace

std::string printable(std::string_view text, Lines lines) {
  return with_replaced(text, [lines](char32_t code, std::string& out) {
    const bool is_layout = code == '\n' || code == '\t';
    out += is_layout && lines == Lines::kMany ? static_cast<char>(code) : '?';
  });
}

std::string printable_json(std::string_view json) {
  return with_replaced(json, [](char32_t code, std::string& out) {
    if (code == '\n') {  // whitespace between values
      out += '\n';
      return;
    }
    constexpr std::string_view kDigits = "0123456789abcdef";
    out += "\\u";
    const char32_t written = code == kInvalid ? 0xfffd : code;  // all others have 16 bits
    for (int shift = 12; shift >= 0; shift -= 4) out += kDigits[written >> shift & 15];
  });
}

std::size_t incomplete_bytes(std::string_view text) {
  for (std::size_t back = 1; back <= std::min<std::size_t>(3, text.size()); ++back) {
    const auto byte = static_cast<unsigned char>(text[text.size() - back]);
    if ((byte & 0xc0) == 0x80) continue;
    return length_from(byte) > back ? back : 0;
  }
  return 0;
}

}  // namespace clamor
