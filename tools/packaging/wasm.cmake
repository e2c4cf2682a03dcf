# wasm.cmake: libclamor as clamor.wasm and the module clamor.mjs that loads it, by emscripten; for tools/bundle.
#
# It has neither threads nor files: contexts have `caller_updates`, and levels come from the caller's memory
# (clamor_open_level_with). Exceptions are WebAssembly's own, and vectors have 128 bits. Its memory can be shared, so that
# an AudioWorklet renders by an instance of its own; TextDecoder would name SharedArrayBuffer, which plain pages lack.
file(READ runtime/clamor.h header)
string(REGEX MATCHALL "CLAMOR_API [a-z_0-9 ]+[*]?[*]? ?clamor_[a-z_]+[(]" functions "${header}")
list(TRANSFORM functions REPLACE ".*(clamor_[a-z_]+)[(]" "_\\1")
list(JOIN functions "," functions)

add_executable(libclamor ${interface_sources})
set_target_properties(libclamor PROPERTIES OUTPUT_NAME clamor SUFFIX .mjs RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})
target_compile_definitions(libclamor PRIVATE CLAMOR_BUILDS_LIBRARY)
target_link_libraries(libclamor PRIVATE clamor_runtime)
target_link_options(libclamor PRIVATE -O3 -lexports.js -Wno-pthreads-mem-growth --no-entry -sMODULARIZE -sEXPORT_ES6 -sEXPORT_NAME=createClamor
  -sENVIRONMENT=web,worker,node -sFILESYSTEM=0 -sALLOW_MEMORY_GROWTH -sALLOW_TABLE_GROWTH -sSTACK_SIZE=1MB -sTEXTDECODER=0
  -sEXPORTED_FUNCTIONS=${functions},_malloc,_free,__emscripten_wasm_worker_initialize
  -sEXPORTED_RUNTIME_METHODS=addFunction,removeFunction,UTF8ToString,stringToUTF8,lengthBytesUTF8,HEAPU8,HEAP32,HEAPU32,HEAPF32,HEAPF64,wasmMemory)

# Highway 1.0.3 has no vectors of doubles for WebAssembly. In these files, arrays stand for vectors.
set_source_files_properties(runtime/mixing/voice_kernel.cpp runtime/propagation/intensity_kernel.cpp
  runtime/voices/biquad_cascade.cpp PROPERTIES SKIP_PRECOMPILE_HEADERS ON
  COMPILE_OPTIONS "-UHWY_DISABLED_TARGETS;-DHWY_DISABLED_TARGETS=HWY_WASM")
