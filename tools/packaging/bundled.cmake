# bundled.cmake: what CLAMOR_BUNDLED changes: libclamor and libclamor_bake alone, on Windows also the program,
# with the libraries that tools/bundle has built inside. It passes their sources as CLAMOR_BUNDLE_SOURCES, and
# where they are installed as CLAMOR_BUNDLE_PREFIX.
if(NOT WIN32)
  set(CLAMOR_PROGRAM OFF)
endif()
set(CLAMOR_WITH_MYSOFA OFF)
set(CLAMOR_WITH_SNDFILE OFF)
set(CLAMOR_WITH_TBB OFF)

if(EMSCRIPTEN)
  add_library(TinyGLTF::TinyGLTF INTERFACE IMPORTED)
  add_library(glm::glm INTERFACE IMPORTED)
  target_include_directories(glm::glm SYSTEM INTERFACE ${CLAMOR_BUNDLE_SOURCES}/glm)
  add_compile_options(-msimd128 -fwasm-exceptions -matomics -mbulk-memory -D_LIBCPP_ENABLE_EXPERIMENTAL)  # std::jthread
  add_link_options(-fwasm-exceptions -sWASM_BIGINT -sWASM_WORKERS=2)
  include_directories(SYSTEM ${CLAMOR_BUNDLE_PREFIX}/include)
  return()
endif()

# Debian's TinyGLTF is a shared library, and OpenMesh builds all of its file formats.
add_library(tinygltf STATIC ${CLAMOR_BUNDLE_SOURCES}/tinygltf/tiny_gltf.cc)
target_include_directories(tinygltf SYSTEM PUBLIC ${CLAMOR_BUNDLE_SOURCES}/tinygltf
  PRIVATE /usr/include/stb ${CLAMOR_BUNDLE_PREFIX}/include ${CLAMOR_BUNDLE_PREFIX}/include/nlohmann)
add_library(TinyGLTF::TinyGLTF ALIAS tinygltf)
file(GLOB openmesh_sources ${CLAMOR_BUNDLE_SOURCES}/openmesh/src/OpenMesh/Core/Mesh/*.cc
  ${CLAMOR_BUNDLE_SOURCES}/openmesh/src/OpenMesh/Core/System/*.cc
  ${CLAMOR_BUNDLE_SOURCES}/openmesh/src/OpenMesh/Core/Utils/*.cc)
add_library(OpenMeshCore STATIC ${openmesh_sources})
target_include_directories(OpenMeshCore SYSTEM PUBLIC ${CLAMOR_BUNDLE_SOURCES}/openmesh/src)

# For the static libraries.
file(GLOB CLAMOR_BUNDLED_ARCHIVES ${CLAMOR_BUNDLE_PREFIX}/lib/*.a)
list(APPEND CLAMOR_BUNDLED_ARCHIVES $<TARGET_FILE:tinygltf> $<TARGET_FILE:OpenMeshCore>)

# No function lies in the file that cannot be reached, and no name of theirs is seen by an application.
add_compile_options(-ffunction-sections -fdata-sections)
if(WIN32)
  add_link_options(-static LINKER:--gc-sections)
else()
  add_link_options(-static-libstdc++ -static-libgcc LINKER:--gc-sections LINKER:-Bsymbolic
    LINKER:--exclude-libs,ALL
    # Parts of the C library that are files of their own before glibc 2.34.
    LINKER:--push-state,--no-as-needed,-l:libpthread.so.0,-l:libdl.so.2,--pop-state)
endif()
