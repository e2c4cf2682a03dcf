// output_options.h: --headphones (the default), --loudspeakers, --hrtf, --layout, --receivers and
// --ambisonics, shared by play and render.
#pragma once

#include <string>

#include "common/result.h"
#include "formats/files/output_target.h"
#include "runtime/mixing/output_format.h"
#include "tools/program/arguments.h"

namespace clamor {

// Holds the words of the command line until read() interprets them.
class OutputArguments {
 public:
  explicit OutputArguments(Arguments& parser);

  // Call after parse(). The Error is bad usage. Does not read the HRTF, which is a file.
  Result<OutputFormat> read() const;

  // Reads the HRTF of a binaural output, which takes a second, and adds its file to `inputs`. The
  // Error is a bad file.
  Result<void> read_head(OutputFormat& shape, InputFiles& inputs) const;

  // A note for users who chose no output; otherwise empty.
  std::string default_output_note() const;

 private:
  bool asked_for_any() const;

  bool headphones_ = false, loudspeakers_ = false, ambisonics_ = false;
  std::string hrtf_, layout_, receivers_;
};

}  // namespace clamor
