// shell.h: runs compilers and programs in a test.
#pragma once

#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "tests/temporary_file.h"

namespace clamor::testing {

// Runs a command and returns what it printed; a failure fails the test.
inline std::string run(const std::string& command) {
  const TemporaryFile output(".txt");
  const int result = std::system((command + " >" + output.path() + " 2>&1").c_str());
  EXPECT_EQ(result, 0) << command << "\n" << output.bytes();
  return output.bytes();
}

inline bool has(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
}

}  // namespace clamor::testing
