// quiet_option.h: --quiet, alike in all commands whose progress and notes it silences.
#pragma once

#include <ostream>

#include "tools/program/arguments.h"

namespace clamor {

class QuietOption {
 public:
  explicit QuietOption(Arguments& parser) {
    parser.flag("--quiet", quiet_, "print only results, warnings and errors");
  }

  // The stream for progress and notes. Call after parse().
  std::ostream& notes(std::ostream& err) { return quiet_ ? silent_ : err; }

 private:
  bool quiet_ = false;
  std::ostream silent_{nullptr};
};

}  // namespace clamor
