// device_options.h: the options of commands that play through a sound device.
#pragma once

#include <string>

#include "common/result.h"
#include "runtime/player/player_options.h"
#include "tools/commands/mix_options.h"
#include "tools/commands/output_options.h"
#include "tools/commands/strategy_options.h"
#include "tools/program/arguments.h"

namespace clamor {

class DeviceArguments {
 public:
  void add_device_options(Arguments& parser);
  void add_recording_options(Arguments& parser);

  // Call after parse(). The Error is bad usage.
  Result<void> read(PlayerOptions& options) const;

 private:
  std::string device_, record_, format_;
  int rate_hz_ = 0, frames_ = 0;
};

// Turns the words into the options of a player in real time. The Error is bad usage. Reads no
// files.
Result<void> read_player_options(const StrategyArguments& strategy, const MixArguments& mix,
                                 const OutputArguments& output, const DeviceArguments& device,
                                 PlayerOptions& options);

}  // namespace clamor
