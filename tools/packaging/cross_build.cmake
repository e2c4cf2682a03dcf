# cross_build.cmake: what tool chains for other systems find: of this system nothing but programs, and else the
# libraries in ${system_root} and those that tools/bundle has built.
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES CLAMOR_BUNDLE_PREFIX)
set(CMAKE_FIND_ROOT_PATH ${system_root} ${CLAMOR_BUNDLE_PREFIX})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} ${CLAMOR_BUNDLE_PREFIX}/lib/pkgconfig:${CLAMOR_BUNDLE_PREFIX}/share/pkgconfig)
