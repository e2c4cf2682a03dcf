// instruction_sets.h: tests of vector code, by every instruction set that this machine has.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "runtime/voices/mix_kernel.h"

namespace clamor::testing {

// Back to the best when a test is over, however it ends.
struct KernelGuard {
  ~KernelGuard() { force_mix_kernel(""); }
};

struct OnInstructionSet : ::testing::TestWithParam<std::string> {
  OnInstructionSet() { force_mix_kernel(GetParam()); }  // of all Highway code
  KernelGuard guard;
};

// INSTANTIATE_TEST_SUITE_P(EveryInstructionSet, ..., every_instruction_set(),
// instruction_set_name);
inline auto every_instruction_set() { return ::testing::ValuesIn(mix_kernel_targets()); }
inline std::string instruction_set_name(const ::testing::TestParamInfo<std::string>& target) {
  return target.param;
}

}  // namespace clamor::testing
