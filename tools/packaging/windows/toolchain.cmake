# toolchain.cmake: MinGW-w64 of Debian (g++-mingw-w64-x86-64-posix) builds for Windows 10 and later.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
# GCC does not align the stack of Windows' functions to 32 bytes, but moves vectors of AVX there as if it did
# (GCC bug 54412). The assembler makes all of these moves unaligned.
set(CMAKE_C_FLAGS_INIT
  "-D_WIN32_WINNT=0x0A00 -DFLAC__NO_DLL -Wa,-muse-unaligned-vector-move -ffunction-sections -fdata-sections")
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT}")
set(system_root /usr/x86_64-w64-mingw32)
include(${CMAKE_CURRENT_LIST_DIR}/../cross_build.cmake)
