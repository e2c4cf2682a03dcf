# debian.cmake: Debian packages by CPack, one for each component; tools/package makes them.
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program runtime development python)
set(CLAMOR_PACKAGE_CONTACT "The Clamor authors <clamor@localhost>" CACHE STRING "The maintainer in Debian packages")
set(CPACK_PACKAGE_CONTACT ${CLAMOR_PACKAGE_CONTACT})
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SOURCE clamor)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

# clamor_package(COMPONENT NAME SECTION SUMMARY TEXT)
function(clamor_package component name section summary text)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${summary}\n${text}" PARENT_SCOPE)
  set(documents ${CMAKE_INSTALL_DATADIR}/doc/${name})
  install(FILES ${PROJECT_SOURCE_DIR}/tools/packaging/copyright DESTINATION ${documents}
    COMPONENT ${component} EXCLUDE_FROM_ALL)
  install(FILES ${PROJECT_BINARY_DIR}/changelog.gz DESTINATION ${documents}
    COMPONENT ${component} EXCLUDE_FROM_ALL OPTIONAL)
endfunction()

find_program(GZIP gzip)
string(TIMESTAMP today "%a, %d %b %Y %H:%M:%S +0000" UTC)  # or SOURCE_DATE_EPOCH
file(WRITE ${PROJECT_BINARY_DIR}/changelog "clamor (${PROJECT_VERSION}) unstable; urgency=medium

  * See CHANGELOG.md of the source.

 -- ${CPACK_PACKAGE_CONTACT}  ${today}
")
add_custom_command(OUTPUT changelog.gz COMMAND sh -c "'${GZIP}' -9nc changelog > changelog.gz" VERBATIM)
add_custom_target(debian_files DEPENDS ${PROJECT_BINARY_DIR}/changelog.gz)

clamor_package(program clamor sound "baked acoustics for games and virtual reality"
  "Traces sound through a glTF level once and stores its emitters and reflections\nin one file, which it plays from where a listener stands, for headphones or\nloudspeakers.")
clamor_package(runtime libclamor${PROJECT_VERSION_MAJOR} libs "baked acoustics for games (shared library)"
  "Streams the acoustics that clamor baked, samples the sources that matter to a\nlistener and mixes them into the buffers of an application.")
clamor_package(development libclamor-dev libdevel "baked acoustics for games (development files)"
  "Header files for C and C++, the static library, what CMake and pkg-config need,\nand the bindings for C# and LuaJIT.")
clamor_package(python python3-clamor python "baked acoustics for Python"
  "Bakes levels, measures impulse responses and renders what listeners hear, with\nNumPy.")

foreach(component PROGRAM RUNTIME)
  set(CPACK_DEBIAN_${component}_PACKAGE_SHLIBDEPS ON)
endforeach()
set(library_package libclamor${PROJECT_VERSION_MAJOR})
file(WRITE ${PROJECT_BINARY_DIR}/debian/shlibs
  "libclamor ${PROJECT_VERSION_MAJOR} ${library_package} (>= ${PROJECT_VERSION})
libclamor_bake ${PROJECT_VERSION_MAJOR} ${library_package} (>= ${PROJECT_VERSION})\n")
file(WRITE ${PROJECT_BINARY_DIR}/debian/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/debian/shlibs ${PROJECT_BINARY_DIR}/debian/triggers)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${library_package} (= ${PROJECT_VERSION})")
# What linking with libclamor.a needs.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS "g++, libembree-dev, libtbb-dev, libflac-dev, libsndfile1-dev, libsoxr-dev,
 libsamplerate0-dev, libmysofa-dev, libcapnp-dev, libzstd-dev, libxxhash-dev, libhwy-dev, libfmt-dev")
string(REPLACE "\n" "" CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS "${CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS}")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.9), python3-numpy, ${library_package} (>= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS clamor)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
# Python's compiled files are written when the package is installed, and removed with it.
file(WRITE ${PROJECT_BINARY_DIR}/debian/postinst "#!/bin/sh
set -e
if command -v py3compile >/dev/null; then py3compile -p python3-clamor; fi
")
file(WRITE ${PROJECT_BINARY_DIR}/debian/prerm "#!/bin/sh
set -e
if command -v py3clean >/dev/null; then py3clean -p python3-clamor; fi
")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/debian/postinst ${PROJECT_BINARY_DIR}/debian/prerm)
include(CPack)
