// interface_fuzz.cpp: a sequence of calls of the C interface. The input decides which functions are
// called and with which arguments: tests/library/call_sequence.h.
// Tells at the end how many calls there were.
//
//   build/fuzz/tests/fuzz_interface tests/fuzz/corpus/interface -max_len=3000 -len_control=0
//   -runs=150000
#include <cstdio>

#include "tests/fuzz/fuzz_target.h"
#include "tests/library/call_sequence.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static unsigned long long calls = 0;
  static const int registered = std::atexit([] { std::printf("%llu calls\n", calls); });
  calls += clamor::testing::make_call_sequence({data, size});
  return registered;
}
