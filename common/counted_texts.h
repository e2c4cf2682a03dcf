// counted_texts.h: tells a text that comes many times once, with its count.
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace clamor {

// Each text once, in the order of first occurrence; "text (3 times)" if it comes more often.
inline std::vector<std::string> with_counts(const std::vector<std::string>& texts) {
  std::unordered_map<std::string_view, std::size_t> counts;
  for (const std::string& text : texts) ++counts[text];
  std::vector<std::string> once;
  for (const std::string& text : texts) {
    std::size_t& count = counts[text];
    if (count > 0) once.push_back(text);
    if (count > 1) once.back() += " (" + std::to_string(count) + " times)";
    count = 0;
  }
  return once;
}

}  // namespace clamor
