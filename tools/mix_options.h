// mix_options.h: --interpolation, --visibility and --rays, alike in play and render.
#pragma once

#include <string>

#include "common/result.h"
#include "runtime/auralizer.h"
#include "tools/arguments.h"

namespace clamor {

// The words of the command line, until read() has made sense of them.
class MixWords {
 public:
  explicit MixWords(Arguments& parser);

  // After parse(); the Error is what the user got wrong.
  Result<void> read(AuralizerOptions& options) const;

 private:
  std::string interpolation_ = "cubic", visibility_ = "on";
  int rays_ = AuralizerOptions{}.rays;
};

}  // namespace clamor
