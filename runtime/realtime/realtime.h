// realtime.h: the attribute REALTIME, for functions that the audio thread may call.
//
// A function marked REALTIME does not allocate, lock, wait, access files, log or throw, and its
// cost is bounded. Clang checks the attribute where it knows it (clang::nonblocking); tests run
// marked code with an allocator and locks that abort.
#pragma once

#if __has_cpp_attribute(clang::nonblocking)
#define REALTIME [[clang::nonblocking]]
#else
#define REALTIME
#endif
