// instruction_sets.h: runs tests of vector code on every instruction set of this machine.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "runtime/voices/mix_kernel.h"

namespace clamor::testing {

// Restores the best instruction set when a test ends.
struct KernelGuard {
  ~KernelGuard() { force_mix_kernel(""); }
};

struct OnInstructionSet : ::testing::TestWithParam<std::string> {
  OnInstructionSet() { force_mix_kernel(GetParam()); }  // applies to all Highway code
  KernelGuard guard;
};

// Usage: INSTANTIATE_TEST_SUITE_P(EveryInstructionSet, ..., every_instruction_set(),
// instruction_set_name);
inline auto every_instruction_set() { return ::testing::ValuesIn(mix_kernel_targets()); }
inline std::string instruction_set_name(const ::testing::TestParamInfo<std::string>& target) {
  return target.param;
}

}  // namespace clamor::testing
