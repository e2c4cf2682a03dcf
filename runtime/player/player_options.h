// player_options.h: what a player plays, for whom, on which device and into which file.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/listener.h"
#include "formats/audio/wav_writer.h"
#include "formats/level/walk_file.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/output/audio_output.h"

namespace clamor {

struct PlayerOptions {
  AuralizerOptions auralizer;
  Listener listener;         // at the start
  std::optional<Walk> walk;  // instead of being moved
  double seconds = 0;        // 0: until stopped
  std::string device;        // as choose_device() takes it, or "none"
  int device_rate_hz = 0;    // 0: 48 kHz where the device can
  int block_frames = 256;
  bool buffer_may_grow = true;           // where the device runs dry (OutputRequest)
  std::shared_ptr<OutputDriver> driver;  // instead of the machine's sound devices
  std::string record;                    // WAV or FLAC file to keep what is heard; empty for none
  SampleFormat record_format = SampleFormat::kFloat32;
};

}  // namespace clamor
