// shell_quote.h: quotes words for a shell, in printed commands.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

namespace clamor {

// Returns the word itself if no character of it is special to a shell, otherwise in single quotes.
inline std::string shell_quoted(const std::string& word) {
  const bool plain = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("-_./:,=+%").find(static_cast<char>(c)) != std::string_view::npos;
  });
  if (plain) return word;
  std::string enclosed = "'";
  for (const char c : word) enclosed += c == '\'' ? "'\\''" : std::string(1, c);
  return enclosed + "'";
}

}  // namespace clamor
