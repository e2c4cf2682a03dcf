// realtime.h: marks what the audio thread may call.
//
// A function marked REALTIME promises: no allocation, lock, wait, file, log or exception, and a
// bounded cost. A compiler that knows the attribute checks it; tests run marked code with an
// allocator and locks that abort.
#pragma once

#if __has_cpp_attribute(clang::nonblocking)
#define REALTIME [[clang::nonblocking]]
#else
#define REALTIME
#endif
