#include "tools/commands/play_status.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "runtime/engine/auralizer_statistics.h"
#include "runtime/player/player_statistics.h"
#include "tools/program/terminal_output.h"

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
std::string meters(const std::array<float, kMaxChannels>& peak, int channels) {
  if (channels == 2) return "L " + meter(peak[0]) + " R " + meter(peak[1]);
  return meter(*std::max_element(peak.begin(), peak.begin() + channels));
}

// "k 1200 of 2000, 87 dropped" under overload, with ", other programs take 45 %" if they do.
std::string load_note(const AuralizerStatistics& now) {
  constexpr double kNoticed = 0.2;
  std::string note;
  if (now.k < now.max_k || now.shed_voices > 0)
    note = fmt::format("k {} of {}, {} dropped", now.k, now.max_k, now.shed_voices);
  if (now.waiting_share > kNoticed)
    note += fmt::format("{}other programs take {:.0f} %", note.empty() ? "" : ", ",
                        100 * now.waiting_share);
  return note;
}

// "NO DEVICE for 1.2 s" while there is none, otherwise "".
std::string device_note(const OutputStatistics& output) {
  if (output.has_device || output.problem.empty()) return "";
  return fmt::format("NO DEVICE for {:.1f} s", output.without_device_now_s);
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

std::vector<std::string> status_fields(const PlayerStatistics& now, const Listener& listener,
                                       int channels) {
  const AuralizerStatistics& auralizer = now.auralizer;
  const auto& callbacks = now.output.callbacks;
  const Vec3& at = listener.position_m;
  return {
      fmt::format("{:6.1f} s", now.time_s),
      device_note(now.output),
      fmt::format("{} voices", auralizer.voices),
      load_note(auralizer),
      fmt::format("{:.1f} LUFS", std::max(now.momentary_lufs, -99.9)),
      fmt::format("at {:.1f},{:.1f},{:.1f},{:.0f}", at.x, at.y, at.z,
                  heading_deg(listener.orientation)),
      fmt::format("cpu {:.0f} %", 100 * callbacks.cpu_share),
      fmt::format("gaps {}", callbacks.underflows),
      fmt::format("{} dBFS{}", meters(auralizer.peak, channels), limited_note(auralizer.limited)),
      fmt::format("{:.1f} LUFS in 3 s", std::max(now.short_term_lufs, -99.9)),
      fmt::format("sampler {:.1f} ms", auralizer.sampler_ms),
      fmt::format("late {}", callbacks.late),
      fmt::format("held {}", auralizer.held_blocks)};
}

void PlayNotices::tell(const PlayerStatistics& now) {
  tell_device(now.output);
  if (file_failed_) return;
  const PageStatistics& pages = now.auralizer.pages;
  const SoundStatistics& sounds = now.auralizer.sounds;
  file_failed_ = pages.failed > 0 || sounds.failed > 0;
  if (pages.failed > 0)
    print_warning(err_, pages.failure + " The pages in memory replace it.");
  else if (sounds.failed > 0)
    print_warning(err_, sounds.failure + " Voices that need it are silent.");
}

void PlayNotices::tell_device(const OutputStatistics& output) {
  if (output.device == "none" && output.problem.empty()) return;
  if (had_device_ == output.has_device) return;
  had_device_ = output.has_device;
  if (output.has_device)
    fmt::print(err_, "sound is back, on {}\n", describe(output));
  else
    fmt::print(err_,
               "no sound from the device ({}); playback continues in silence and the device is "
               "tried again\n",
               output.problem);
}

}  // namespace clamor
