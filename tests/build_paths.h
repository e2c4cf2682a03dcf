// build_paths.h: where the tested tree and programs are.
//
// These paths are compiled in build_paths.cpp alone. A definition on every compiler command would
// keep a compiler cache from sharing test objects between two clones.
#pragma once

namespace clamor::testing {

extern const char kSourceDir[];     // root of the repository
extern const char kProgram[];       // the program `clamor`
extern const char kJackListener[];  // the program that waits for sound from a JACK client

}  // namespace clamor::testing
