# toolchain.cmake: GCC of Debian (g++-aarch64-linux-gnu) builds for Linux on 64-bit ARM processors.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
# GCC would round a * b + c once where x86-64 without FMA rounds twice. Highway's kernels are compiled for
# processors with AES, which they do not use, and GCC puts no function into others that may lack it.
set(CMAKE_C_FLAGS_INIT "-ffunction-sections -fdata-sections -ffp-contract=off -march=armv8-a+crypto")
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT}")
set(system_root /usr/aarch64-linux-gnu)
include(${CMAKE_CURRENT_LIST_DIR}/../cross_build.cmake)
