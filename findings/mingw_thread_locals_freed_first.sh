#!/usr/bin/env bash
# GCC 12 for mingw-w64 10.0.0: a thread's thread_local variables are freed before its destructors run.
#
# When a thread ends, C++ destroys its thread_local objects one after the other, and what has no destructor, such as
# an int, is there until the thread has ended. With the POSIX threads of MinGW in Debian 12, GCC keeps all of them in
# memory of its own ("emulated TLS"), which a destructor of winpthreads' thread-specific data frees. Destructors of
# C++ objects run later. A destructor that reads a thread_local int finds its initial value, because the memory was
# freed and has been made anew, and the destructor's own object lies in memory that is freed already: that of a
# vector or a smart pointer gives back what it finds there.
#
# It concerns programs whose threads keep buffers or caches in thread_local objects and end before the program does:
# they work, or crash at the end of a thread. Let whoever starts the thread own such objects, or keep them on its
# stack. Variables without destructors are safe until then.
set -euo pipefail
command -v x86_64-w64-mingw32-g++-posix wine >/dev/null ||
  { echo "install g++-mingw-w64-x86-64-posix and wine64 of Debian 12"; exit 1; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
version=$(dpkg-query -W -f '${Version}' g++-mingw-w64-x86-64-posix)
[[ $version == 12.2.0-* ]] || { echo "this is GCC $version for MinGW, and not 12.2.0 of Debian 12"; exit 1; }

cat >order.cpp <<'EOF'
#include <cstdio>
#include <thread>

thread_local int number = 1;
int seen = 0;

struct AtEnd {
  ~AtEnd() { seen = number; }  // touches nothing of itself
};

int main() {
  std::thread([] {
    thread_local AtEnd at_end;
    (void)&at_end;
    number = 42;
  }).join();
  std::printf("the thread left %d, its destructor read %d\n", 42, seen);
}
EOF
x86_64-w64-mingw32-g++-posix -O1 -static order.cpp -o order.exe
g++ -O1 -pthread order.cpp -o order
WINEPREFIX=$folder/wine WINEDEBUG=-all WINEDLLOVERRIDES='mscoree,mshtml=' wine order.exe 2>/dev/null |
  tr -d '\r' | sed 's/^/MinGW: /' | tee seen
WINEPREFIX=$folder/wine wineserver -k || true
./order | sed 's/^/this system: /' | tee -a seen
cat >expected <<'EOF'
MinGW: the thread left 42, its destructor read 1
this system: the thread left 42, its destructor read 42
EOF
cmp -s seen expected || { echo "that is not what was found with GCC 12.2.0 for MinGW and wine 8.0"; exit 1; }
