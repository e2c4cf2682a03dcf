// build_paths.h: paths of the source tree and of the programs under test.
//
// The paths are compiled into build_paths.cpp only. As definitions on every compiler command they
// would keep a compiler cache from sharing the tests' objects between clones.
#pragma once

namespace clamor::testing {

extern const char kSourceDir[];     // root of the repository
extern const char kProgram[];       // the program `clamor`
extern const char kJackListener[];  // the program that waits for sound from a JACK client

}  // namespace clamor::testing
