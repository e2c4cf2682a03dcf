// play_history.h: what happened while clamor play played: loudness, voices and load over time, for
// the report at its end.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/listener.h"
#include "common/result.h"
#include "formats/files/output_target.h"
#include "runtime/player/player.h"
#include "tools/analysis/spectrogram.h"

namespace clamor {

class PlayHistory {
 public:
  // What is the case now; kept ten times a second of what is played, at most for 10 hours.
  void add(const PlayerStatistics& now, const Listener& listener);

  // Voices that sounded: those of the newest keyframe without those shed.
  double mean_voices() const;
  std::uint32_t least_voices() const;
  double loudness_lufs() const;  // the mean power of all that was heard; -infinity in silence

  // An Error where write() could not write to that folder or would replace one of the inputs.
  static Result<void> check_folder(const std::string& folder, const InputFiles& inputs);

  // A page with curves and tables, as FOLDER/play.html, play.json and CSV files; with a picture of
  // what was heard, where that was recorded.
  Result<void> write(const std::string& folder, const std::string& level,
                     const PlayerStatistics& played, std::span<const ThreadCpuUsage> threads,
                     const std::optional<Spectrogram>& heard) const;

 private:
  struct Moment {
    double time_s;
    Vec3 position_m;
    double momentary_lufs, short_term_lufs;
    std::uint32_t voices, k;
    double audio_share, sampler_ms;
    std::uint64_t late_callbacks, held_blocks;
  };
  std::vector<Moment> moments_;
};

}  // namespace clamor
