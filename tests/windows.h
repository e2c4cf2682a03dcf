// windows.h: what tests use of POSIX and MinGW lacks, included before every file of theirs.
#pragma once

#include <cstdio>
#include <cstring>
#include <filesystem>

// Writes a number of six digits in place of the Xs.
inline char* mkdtemp(char* name) {
  char* const digits = name + std::strlen(name) - 6;
  for (int i = 0; i < 1'000'000; ++i) {
    std::snprintf(digits, 7, "%06d", i);
    if (std::filesystem::create_directory(name)) return name;
  }
  return nullptr;
}
