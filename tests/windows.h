// windows.h: what tests use of POSIX and MinGW lacks, included before every file of theirs.
#pragma once

#include <direct.h>
#include <io.h>

inline char* mkdtemp(char* name) {
  return ::_mktemp(name) != nullptr && ::_mkdir(name) == 0 ? name : nullptr;
}
