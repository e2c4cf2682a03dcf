// build_paths.h: paths of the source tree and of the programs under test.
//
// The paths are compiled into build_paths.cpp only. As definitions on every compiler command they
// would keep a compiler cache from sharing the tests' objects between clones.
#pragma once

#include <string>

namespace clamor::testing {

extern const char kSourceDir[];     // root of the repository
extern const char kProgram[];       // the program `clamor`
extern const char kJackListener[];  // the program that waits for sound from a JACK client

// The path of a real level. The levels lie beside the repository and may be absent.
std::string shared_level(const std::string& name);

// The path of a small input that other programs wrote; they lie there, too.
std::string shared_case(const std::string& name);

}  // namespace clamor::testing
