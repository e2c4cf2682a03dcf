// player_options.h: the options of a player.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/listener.h"
#include "formats/audio/wav_writer.h"
#include "formats/level/walk_file.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/output/audio_output.h"

namespace clamor {

struct PlayerOptions {
  AuralizerOptions auralizer;
  Listener listener;         // initial
  std::optional<Walk> walk;  // instead of Player::move()
  double seconds = 0;        // 0: until stopped
  std::string device;        // as choose_device() takes it, or "none"
  int device_rate_hz = 0;    // 0: 48 kHz if the device can
  int block_frames = 256;
  bool buffer_may_grow = true;           // after underflows (OutputRequest)
  std::shared_ptr<OutputDriver> driver;  // null: the machine's sound devices
  // Takes what was played, interleaved, in order, at least every few milliseconds. Called by the
  // sampler thread; must not wait.
  std::function<void(std::span<const float>)> listen;
  std::string record;  // WAV or FLAC file to record to; empty: none
  SampleFormat record_format = SampleFormat::kFloat32;
};

}  // namespace clamor
