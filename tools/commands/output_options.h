// output_options.h: what the channels are, --headphones, --loudspeakers, --hrtf, --layout,
// --receivers and --ambisonics, alike in play and render. Headphones are the default.
#pragma once

#include <string>

#include "common/result.h"
#include "formats/files/output_target.h"
#include "runtime/mixing/output_format.h"
#include "tools/program/arguments.h"

namespace clamor {

// The words of the command line, until read() has made sense of them.
class OutputArguments {
 public:
  explicit OutputArguments(Arguments& parser);

  // After parse(); the Error is what the user got wrong. Without the head, which is a file.
  Result<OutputFormat> read() const;

  // Reads the head where the shape has one, which takes a second, and adds its file to the inputs;
  // the Error is what is wrong with the file.
  Result<void> read_head(OutputFormat& shape, InputFiles& inputs) const;

  // One line for a user who asked for no output in particular; empty for others.
  std::string default_output_note() const;

 private:
  bool asked_for_any() const;

  bool headphones_ = false, binaural_ = false, loudspeakers_ = false, ambisonics_ = false;
  std::string hrtf_, layout_, receivers_;
};

}  // namespace clamor
