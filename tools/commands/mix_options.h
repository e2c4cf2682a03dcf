// mix_options.h: --interpolation, --visibility, --rays, --memory, --no-mmap, --gain,
// --limiter and --moving, shared by play, view and render.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "formats/files/file_access.h"
#include "formats/files/output_target.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "tools/program/arguments.h"

namespace clamor {

// Holds the words of the command line until read() interprets them.
class MixArguments {
 public:
  explicit MixArguments(Arguments& parser);

  // Call after parse(). Leaves options.limit as it is unless --limiter is given. The Error is bad
  // usage. Does not read the script, which is a file.
  Result<void> read(AuralizerOptions& options) const;

  FileAccess access() const { return no_mmap_ ? FileAccess::kRead : FileAccess::kMap; }

  // Reads the script, if there is one, for a bake with that many signals, and adds its files to
  // `inputs`. The Error is a bad file.
  Result<void> read_script(AuralizerOptions& options, std::size_t baked_signals,
                           InputFiles& inputs) const;

 private:
  std::string interpolation_ = "cubic", visibility_ = "on", gain_ = "0dB", script_;
  std::optional<std::string> memory_, limiter_;
  bool no_mmap_ = false;
  int rays_ = AuralizerOptions{}.rays;
};

}  // namespace clamor
