// checksums.h: makes every checksum match, as in a file whose forger computed them.
//
// Programs that link checksums.cpp replace hash_of() (clamor_forgeable in CMake). While
// `checksums_are_off` all hashes are equal, in files that are written and in files that are read,
// whatever the format hashes and wherever it stores the hash.
#pragma once

#include <functional>

namespace clamor::testing {

extern bool checksums_are_off;

// Called once, after the next hash: for tests that change a file between check and use.
extern std::function<void()> after_checksum;

struct ChecksumsOff {
  ChecksumsOff() { checksums_are_off = true; }
  ~ChecksumsOff() { checksums_are_off = false; }
};

}  // namespace clamor::testing
