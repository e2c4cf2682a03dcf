// utf8_path.h: file names of the standard library from UTF-8, as all text here is.
//
// On Windows, libstdc++ makes names from char by the C library's locale, which cannot be UTF-8 there;
// path::string() gives UTF-8 everywhere.
#pragma once

#include <filesystem>
#include <string_view>

namespace clamor {

inline std::filesystem::path path_of(std::string_view text) {
  return {std::u8string_view(reinterpret_cast<const char8_t*>(text.data()), text.size())};
}

}  // namespace clamor
