// name_length.h: bounds the length of names and other texts that come from files.
//
// A forged level, sidecar, script or bake may hold a name of a megabyte. Readers shorten texts as
// they read them, so that no message, table, page, picture or JSON is as long as that.
#pragma once

#include <cstddef>
#include <string>

#include "common/printable.h"

namespace clamor {

inline constexpr std::size_t kMaxNameBytes = 500;
inline constexpr std::size_t kMaxTextBytes = 4096;  // of sentences, paths and arguments

// Cuts the middle out of a text that has more than `most` bytes; the rest has at most so many.
inline void shorten(std::string& text, std::size_t most = kMaxNameBytes) {
  if (text.size() <= most) return;
  const std::size_t half = (most - 3) / 2;
  std::string begin = text.substr(0, half), end = text.substr(text.size() - half);
  begin.resize(begin.size() - incomplete_bytes(begin));
  while (!end.empty() && (static_cast<unsigned char>(end.front()) & 0xc0) == 0x80) end.erase(0, 1);
  text = begin + "..." + end;
}

}  // namespace clamor
