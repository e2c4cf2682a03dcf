#include "tools/commands/play_status.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "runtime/engine/auralizer_statistics.h"
#include "runtime/player/player_statistics.h"
#include "tools/program/printable_stream.h"

namespace clamor {

namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

std::string meter(float peak) {
  constexpr int kWidth = 12;
  const double level_db = 20 * std::log10(std::max(static_cast<double>(peak), 1e-4));
  const int lit =
      std::clamp(static_cast<int>(std::lround((level_db + 60) / 60 * kWidth)), 0, kWidth);
  return fmt::format("{}{} {:>5.1f}", std::string(static_cast<std::size_t>(lit), '#'),
                     std::string(static_cast<std::size_t>(kWidth - lit), '.'), level_db);
}

// Two meters for two channels, otherwise one for the loudest channel.
std::string meters(const float (&peak)[kMaxChannels], int channels) {
  if (channels == 2) return "L " + meter(peak[0]) + " R " + meter(peak[1]);
  return meter(*std::max_element(peak, peak + channels));
}

// " (k 1200 of 2000, 87 dropped)" under overload, with ", other programs take 45 %" if they do.
std::string load_note(const AuralizerStatistics& now) {
  constexpr double kNoticed = 0.2;
  std::string note;
  if (now.k < now.max_k || now.shed_voices > 0)
    note = fmt::format("k {} of {}, {} dropped", now.k, now.max_k, now.shed_voices);
  if (now.waiting_share > kNoticed)
    note += fmt::format("{}other programs take {:.0f} %", note.empty() ? "" : ", ",
                        100 * now.waiting_share);
  return note.empty() ? "" : " (" + note + ")";
}

// "  NO DEVICE for 1.2 s" while there is none, otherwise "".
std::string device_note(const OutputStatistics& output) {
  if (output.has_device || output.problem.empty()) return "";
  return fmt::format("  NO DEVICE for {:.1f} s", output.without_device_now_s);
}

// Direction that the listener faces, positive to the left of -Z.
double heading_deg(const Orientation& orientation) {
  return kDegrees * std::atan2(-orientation.right().z, orientation.right().x);
}

}  // namespace

std::string describe(const OutputStatistics& output) {
  if (output.device == "none")
    return fmt::format("no device, {} frames a block", output.block_frames);
  return fmt::format(
      "{} at {:g} kHz{}, {} frames a block{}", output.device, output.rate_hz / 1e3,
      output.resamples ? " (resampled)" : "", output.block_frames,
      output.latency_s > 0 ? fmt::format(", {:.0f} ms latency", 1e3 * output.latency_s) : "");
}

std::string sounds_line(const SoundStatistics& sounds) {
  const double all_MB = static_cast<double>(sounds.all_bytes) / 1e6;
  if (sounds.all_bytes <= sounds.budget_bytes)
    return fmt::format("sounds: {:.1f} MB decoded, all of which fits into memory", all_MB);
  return fmt::format(
      "sounds: {:.1f} MB decoded, of which {:.1f} MB fit into memory, the loudest first; {} holds "
      "all",
      all_MB, static_cast<double>(sounds.budget_bytes) / 1e6, memory_for_all(sounds));
}

std::string memory_for_all(const SoundStatistics& sounds) {
  return fmt::format("--memory {}MB", (2 * sounds.all_bytes + 999'999) / 1'000'000);
}

std::string limited_note(const Limiter::Work& limited) {
  if (limited.frames == 0) return "";
  return fmt::format(" (limited by {:.1f} dB)",
                     -20 * std::log10(static_cast<double>(limited.min_gain)));
}

std::string status_line(const PlayerStatistics& now, const Listener& listener, int channels) {
  const Vec3& at = listener.position_m;
  return fmt::format(
      "{:6.1f} s  at {:.1f} {:.1f} {:.1f} yaw {:.0f}  {} voices{}  {} dBFS  {:.1f} LUFS, 3 s "
      "{:.1f}{}  cpu {:.0f} %  "
      "sampler {:.1f} ms  late {}  gaps {}  held {}{}",
      now.time_s, at.x, at.y, at.z, heading_deg(listener.orientation), now.auralizer.voices,
      load_note(now.auralizer), meters(now.auralizer.peak, channels),
      std::max(now.momentary_lufs, -99.9), std::max(now.short_term_lufs, -99.9),
      limited_note(now.auralizer.limited), 100 * now.output.callbacks.cpu_share,
      now.auralizer.sampler_ms, now.output.callbacks.late, now.output.callbacks.underflows,
      now.auralizer.held_blocks, device_note(now.output));
}

void PlayNotices::tell(const PlayerStatistics& now) {
  tell_device(now.output);
  if (file_failed_) return;
  const PageStatistics& pages = now.auralizer.pages;
  const SoundStatistics& sounds = now.auralizer.sounds;
  file_failed_ = pages.failed > 0 || sounds.failed > 0;
  if (pages.failed > 0)
    fmt::print(err_, "warning: {} The pages in memory replace it.\n", pages.failure);
  else if (sounds.failed > 0)
    fmt::print(err_, "warning: {} Voices that need it are silent.\n", sounds.failure);
}

void PlayNotices::tell_device(const OutputStatistics& output) {
  if (output.device == "none" && output.problem.empty()) return;
  if (had_device_ == output.has_device) return;
  had_device_ = output.has_device;
  if (over_line_) err_ << to_line_start << clear_rest_of_line;
  if (output.has_device)
    fmt::print(err_, "sound is back, on {}\n", describe(output));
  else
    fmt::print(err_,
               "no sound from the device ({}); playback continues in silence and the device is "
               "tried again\n",
               output.problem);
}

}  // namespace clamor
