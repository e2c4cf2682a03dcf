// checksums.h: a world in which every checksum is right, as in a file whose forger knew how to sum.
//
// Programs that link checksums.cpp have it stand in for hash_of() (CMake's clamor_forgeable). While
// `checksums_are_off` everything sums to the same, in files that are written and in those that are
// read, whatever the format sums and wherever it keeps it.
#pragma once

#include <functional>

namespace clamor::testing {

extern bool checksums_are_off;

// Called once, after the next sum: for whoever writes to a file between check and use.
extern std::function<void()> after_checksum;

struct ChecksumsOff {
  ChecksumsOff() { checksums_are_off = true; }
  ~ChecksumsOff() { checksums_are_off = false; }
};

}  // namespace clamor::testing
