// play_history.h: loudness, voices and load over time, for the report of clamor play.
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
#include "runtime/player/player_statistics.h"
#include "tools/analysis/report_page.h"
#include "tools/analysis/spectrogram.h"

namespace clamor {

class PlayHistory {
 public:
  // Records the current values, ten times a second of played time, for at most 10 hours.
  void add(const PlayerStatistics& now, const Listener& listener);

  // Voices that are mixed: those of the newest keyframe, less the dropped ones.
  double mean_voices() const;
  std::uint32_t min_voices() const;
  double loudness_lufs() const;  // from the mean power; -infinity for silence

  // Checks that write() can write to that folder and would not replace one of the inputs.
  static Result<void> check_folder(const std::string& folder, const InputFiles& inputs);

  // Writes FOLDER/play.html, play.json and CSV files, with a spectrogram if the sound was recorded.
  Result<void> write(const std::string& folder, const std::string& level,
                     const PlayerStatistics& played, std::span<const ThreadCpuUsage> threads,
                     const std::optional<Spectrogram>& heard) const;

 private:
  ReportTable figures_of(const PlayerStatistics& played) const;

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
