// win32.h: Windows' functions, with UTF-8 text and errno.
#pragma once

#ifndef NOMINMAX
#define NOMINMAX
#endif
#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
// clang-format off
#include <windows.h>  // before others of Windows
#include <psapi.h>
#include <shellapi.h>
// clang-format on

#include <cerrno>
#include <random>
#include <string>
#include <string_view>

namespace clamor {

// UTF-8 to UTF-16 and back. What is no valid text becomes U+FFFD.
std::wstring wide(std::string_view text);
std::string narrow(std::wstring_view text);

// A path for Windows' functions, which take more than 260 characters with a prefix only.
std::wstring wide_path(const std::string& path);

// Sets errno by the last error of a Windows function; returns false.
bool fail_by_last_error();

// Calls make(pattern) with other letters in the place of its XXXXXX until it succeeds, or fails for
// another reason than that the name exists.
template <class Make>
bool try_names(std::string& pattern, const Make& make) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789";
  constexpr std::size_t kRandomLetters = 6;
  constexpr int kAttempts = 100;
  std::random_device random;
  for (int attempts = 0; attempts < kAttempts; ++attempts) {
    for (std::size_t i = pattern.size() - kRandomLetters; i < pattern.size(); ++i)
      pattern[i] = kLetters[random() % kLetters.size()];
    if (make(pattern)) return true;
    if (errno != EEXIST) return false;
  }
  return false;
}

}  // namespace clamor
