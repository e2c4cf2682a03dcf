# windows.cmake: the tests of the libraries' interfaces, but those that need POSIX, as a program for Wine.
# GoogleTest is compiled of Debian's sources (libgtest-dev).
add_subdirectory(/usr/src/googletest googletest EXCLUDE_FROM_ALL)
file(GLOB sources CONFIGURE_DEPENDS library/*.cpp)
list(FILTER sources EXCLUDE REGEX "/(clamor_(fork|lifetimes)|sdl_game|[a-z]+_binding|installed_[a-z_]+)_test[.]cpp$")
add_executable(test_library ${sources} build_paths.cpp)
set_source_files_properties(build_paths.cpp PROPERTIES COMPILE_DEFINITIONS
  "CLAMOR_SOURCE_DIR=\"${PROJECT_SOURCE_DIR}\";CLAMOR_PROGRAM=\"$<TARGET_FILE:clamor>\";CLAMOR_JACK_LISTENER=\"\"")
target_link_libraries(test_library PRIVATE clamor_options libclamor libclamor_bake clamor_bake clamor_player
  nlohmann_json::nlohmann_json GTest::gtest_main GTest::gmock)
target_compile_options(test_library PRIVATE -O1 -include ${CMAKE_CURRENT_SOURCE_DIR}/windows.h)
set_target_properties(test_library PROPERTIES UNITY_BUILD_BATCH_SIZE 16
  RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})  # beside the libraries
