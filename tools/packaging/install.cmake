# install.cmake: what `cmake --install` puts where, in the components program, runtime (the shared
# library), development and python.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# --- libclamor.a: the library's objects as one, in which only the interface is global -------------
# clamor_static(TARGET ARCHIVES...): libclamor.a for libclamor.so, with what it needs of the archives.
# Its names cannot clash with an application's. The linker takes the groups of inline functions
# apart, because it could otherwise replace one of them by an application's and lose a local name.
# Objcopy makes weak symbols local, but not GCC's unique ones, so these become weak first; it refuses
# an empty list of them.
function(clamor_static target)
  set(library ${PROJECT_BINARY_DIR}/static/${target}.a)
  add_custom_command(OUTPUT ${library}
    COMMAND ${CMAKE_LINKER} -r --force-group-allocation -o ${target}_all.o $<TARGET_OBJECTS:${target}>
      --start-group ${ARGN} --end-group
    COMMAND sh -c "(echo '# unique' && '${CMAKE_NM}' ${target}_all.o | sed -n 's/.* u //p') > ${target}_unique.txt"
    COMMAND ${CMAKE_OBJCOPY} --weaken-symbols=${target}_unique.txt ${target}_all.o
    COMMAND ${CMAKE_OBJCOPY} --wildcard --keep-global-symbol=clamor_* --strip-debug ${target}_all.o ${target}.o
    COMMAND ${CMAKE_COMMAND} -E rm -f ${library}
    COMMAND ${CMAKE_COMMAND} -E make_directory static
    COMMAND ${CMAKE_AR} qcsD ${library} ${target}.o
    DEPENDS ${target} $<TARGET_OBJECTS:${target}>
    COMMAND_EXPAND_LISTS VERBATIM)
  add_custom_target(${target}_static ALL DEPENDS ${library})
  install(FILES ${library} DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
endfunction()

if(NOT CLAMOR_SANITIZE AND NOT WIN32)
  set(shared_parts $<TARGET_FILE:clamor_formats> $<TARGET_FILE:clamor_common> ${CLAMOR_BUNDLED_ARCHIVES})
  clamor_static(libclamor $<TARGET_FILE:clamor_runtime> ${shared_parts})
  if(CLAMOR_BUNDLED)
    clamor_static(libclamor_bake $<TARGET_FILE:clamor_bake> ${shared_parts})
  endif()
endif()

# What an application links besides libclamor.a.
set(CLAMOR_STATIC_LIBRARIES stdc++ m pthread)
if(NOT CLAMOR_BUNDLED)
  list(PREPEND CLAMOR_STATIC_LIBRARIES embree${embree_VERSION_MAJOR} FLAC soxr samplerate capnp kj zstd xxhash hwy fmt)
endif()
foreach(library mysofa sndfile tbb)
  string(TOUPPER CLAMOR_WITH_${library} with)
  if(${with})
    list(PREPEND CLAMOR_STATIC_LIBRARIES ${library})
  endif()
endforeach()
list(TRANSFORM CLAMOR_STATIC_LIBRARIES PREPEND -l OUTPUT_VARIABLE CLAMOR_STATIC_FLAGS)
list(JOIN CLAMOR_STATIC_FLAGS " " CLAMOR_STATIC_FLAGS)

set(installed_libraries libclamor)
if(CLAMOR_PROGRAM OR CLAMOR_BUNDLED)
  list(APPEND installed_libraries libclamor_bake)
endif()
install(TARGETS ${installed_libraries} EXPORT clamor
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT development
  RUNTIME DESTINATION bin COMPONENT runtime ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  PUBLIC_HEADER DESTINATION include COMPONENT development)
set(cmake_folder ${CMAKE_INSTALL_LIBDIR}/cmake/clamor)
install(EXPORT clamor NAMESPACE clamor:: FILE clamor-targets.cmake DESTINATION ${cmake_folder} COMPONENT development)
configure_package_config_file(tools/packaging/clamor-config.cmake.in clamor-config.cmake
  INSTALL_DESTINATION ${cmake_folder} PATH_VARS CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(clamor-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/clamor-config.cmake ${PROJECT_BINARY_DIR}/clamor-config-version.cmake
  DESTINATION ${cmake_folder} COMPONENT development)
file(RELATIVE_PATH CLAMOR_PREFIX_FROM_PKGCONFIG /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(runtime/clamor.pc.in clamor.pc @ONLY)
configure_file(bake/clamor_bake.pc.in clamor_bake.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/clamor.pc $<$<TARGET_EXISTS:libclamor_bake>:${PROJECT_BINARY_DIR}/clamor_bake.pc>
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

# --- The program, its man pages and completions ---------------------------------------------------
if(CLAMOR_PROGRAM)
  install(TARGETS clamor COMPONENT program)
endif()
if(CLAMOR_PROGRAM AND NOT CLAMOR_SANITIZE AND NOT CMAKE_CROSSCOMPILING)
  find_program(GZIP gzip REQUIRED)
  set(share ${PROJECT_BINARY_DIR}/share)
  add_custom_command(OUTPUT ${share}/written
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${share}
    COMMAND clamor manual ${share}
    COMMAND sh -c "'${GZIP}' -9n '${share}'/man/man1/*.1"
    COMMAND ${CMAKE_COMMAND} -E touch ${share}/written
    DEPENDS clamor VERBATIM)
  add_custom_target(manual ALL DEPENDS ${share}/written)
  install(DIRECTORY ${share}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT program)
  install(DIRECTORY ${share}/bash-completion ${share}/fish DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT program)
  set(zsh_folder site-functions)
  if(CMAKE_INSTALL_PREFIX STREQUAL /usr AND EXISTS /etc/debian_version)
    set(zsh_folder vendor-completions)  # site-functions are the administrator's there
  endif()
  install(DIRECTORY ${share}/zsh/site-functions/ DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/${zsh_folder}
    COMPONENT program)
endif()

# --- The Python package ---------------------------------------------------------------------------
set(CLAMOR_PYTHON_FOLDER lib/python3/dist-packages CACHE STRING "Where the Python package is installed")
install(DIRECTORY runtime/bindings/python/clamor DESTINATION ${CLAMOR_PYTHON_FOLDER} COMPONENT python
  PATTERN __pycache__ EXCLUDE)
install(FILES runtime/clamor.h bake/clamor_bake.h DESTINATION ${CLAMOR_PYTHON_FOLDER}/clamor COMPONENT python)
