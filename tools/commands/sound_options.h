// sound_options.h: the options of commands that mix a bake, alike in all of them.
//
// Arguments::parse() interprets the words and writes them to the options that are given here. The
// files that they name are read later.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "formats/files/file_access.h"
#include "formats/files/output_target.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/mixing/output_format.h"
#include "runtime/player/player_options.h"
#include "tools/program/arguments.h"
#include "tools/strategies/strategies.h"

namespace clamor {

// --strategy, --voices, --estimator and what tunes them.
void add_strategy_options(Arguments& parser, StrategyOptions& options);

// The options of a strategy, and --interpolation, --visibility, --rays, --memory, --no-mmap,
// --gain, --limiter and --moving.
class MixArguments {
 public:
  // Leaves options.limit as it is unless --limiter is given.
  MixArguments(Arguments& parser, AuralizerOptions& options);

  const StrategyOptions& strategy() const { return strategy_; }
  FileAccess access() const { return no_mmap_ ? FileAccess::kRead : FileAccess::kMap; }

  // Reads the script, if there is one, for a bake with that many signals, and adds its files to
  // `inputs`. The Error is a bad file.
  Result<void> read_script(AuralizerOptions& options, std::size_t baked_signals,
                           InputFiles& inputs) const;

 private:
  StrategyOptions strategy_;
  std::string gain_ = "0dB", script_;
  std::optional<bool> limiter_;
  bool no_mmap_ = false;
};

// --headphones (the default), --loudspeakers, --hrtf, --layout, --receivers and --ambisonics.
class OutputArguments {
 public:
  OutputArguments(Arguments& parser, OutputFormat& format);

  // Reads the HRTF of a binaural output, which takes a second, and adds its file to `inputs`. The
  // Error is a bad file.
  Result<void> read_head(OutputFormat& format, InputFiles& inputs) const;

  // A note for users who chose no output; otherwise empty.
  std::string default_output_note() const;

 private:
  bool asked_for_any() const;

  bool headphones_ = false, loudspeakers_ = false, ambisonics_ = false;
  std::string hrtf_, layout_, receivers_;
};

// The options of a player in real time.
class DeviceArguments {
 public:
  explicit DeviceArguments(PlayerOptions& options);
  void add_device_options(Arguments& parser);
  void add_recording_options(Arguments& parser);

  // Call it by Arguments::then(), once the output format is known. The Error is bad usage.
  Result<void> interpret();

 private:
  PlayerOptions& options_;
  std::string format_;
  int frames_ = 0;
};

}  // namespace clamor
