// drawn_page.h: what the scripts of a page draw, by Node.
#pragma once

#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "tests/build_paths.h"
#include "tests/shell.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

inline bool has_node() { return has("node"); }

// The markup of the page in that file.
inline std::string drawn(const std::string& page) {
  const std::string out = page + ".drawn";
  const std::string command = "node '" + std::string(kSourceDir) +
                              "/tests/tools/report/page/draw.mjs' '" + page + "' > '" + out + "'";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return read(out);
}

}  // namespace clamor::testing
