#include "tools/commands/play_status.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "runtime/engine/auralizer_statistics.h"
#include "runtime/mixing/limiter.h"
#include "runtime/player/player_statistics.h"
#include "runtime/realtime/thread_cpu_usage.h"
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

// "--memory 90MB", with which all sounds fit.
std::string memory_for_all(const SoundStatistics& sounds) {
  return fmt::format("--memory {}MB", (2 * sounds.all_bytes + 999'999) / 1'000'000);
}

// " (limited by 2.1 dB)" once the limiter has worked, otherwise "".
std::string limited_note(const Limiter::Work& limited) {
  if (limited.frames == 0) return "";
  return fmt::format(" (limited by {:.1f} dB)",
                     -20 * std::log10(static_cast<double>(limited.min_gain)));
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

namespace {

std::string times(std::uint64_t count) {
  return count == 1 ? "once" : fmt::format("{} times", count);
}

void print_device(const OutputStatistics& output, std::ostream& err) {
  if (output.device == "none" && output.problem.empty()) return;
  fmt::print(err, "device: {}", describe(output));
  if (output.losses > 0) fmt::print(err, ", lost {}", times(output.losses));
  if (output.reopenings > 0) fmt::print(err, ", opened again {}", times(output.reopenings));
  if (output.without_device_s > 0)
    fmt::print(err, ", {:.1f} s without it, at most {:.1f} s at a time", output.without_device_s,
               output.longest_without_s);
  fmt::print(err, "\n");
  if (output.failed_openings > 0)
    fmt::print(err, "        opening it failed {}: {}\n", times(output.failed_openings),
               output.opening_problem);
  if (output.hung_closings > 0)
    fmt::print(err, "        closing it hung {} and was abandoned\n", times(output.hung_closings));
}

void print_threads(std::span<const ThreadCpuUsage> threads, std::ostream& err) {
  constexpr double kSmallest = 5e-4;
  fmt::print(err, "CPU, share of one core: ");
  double sum = 0;
  for (const ThreadCpuUsage& thread : threads) {
    sum += thread.share;
    if (thread.share > kSmallest) fmt::print(err, "{} {:.1f} %, ", thread.name, 100 * thread.share);
  }
  fmt::print(err, "in total {:.1f} %\n", 100 * sum);
}

void print_overload(const AuralizerStatistics& played, std::ostream& err) {
  if (played.starved_keyframes > 0)
    fmt::print(err,
               "other programs: they made {} of {} late keyframes late; keyframes were begun up to "
               "{:.0f} ms ahead, at the end {:.0f} ms and with a sample for {}\n",
               played.starved_keyframes, played.late_keyframes, 1e3 * played.max_lead_s,
               1e3 * played.lead_s,
               played.keyframes_per_sample > 1
                   ? fmt::format("{} of them", played.keyframes_per_sample)
                   : "each");
  if (played.min_k >= played.max_k && played.shedding_blocks == 0) return;
  fmt::print(err,
             "overload: {} keyframes late by themselves; k fell to {} of {} and ended at {}; {} "
             "blocks dropped voices, at most {}\n",
             played.late_keyframes - played.starved_keyframes, played.min_k, played.max_k, played.k,
             played.shedding_blocks, played.max_shed_voices);
}

// Nearly every start has some bounded keyframes, so less than a second of them is not reported.
void print_bounded_search(const AuralizerStatistics& played, std::ostream& err) {
  constexpr std::uint64_t kReportedKeyframes = 50;
  if (played.bounded_keyframes < kReportedKeyframes) return;
  fmt::print(err,
             "in {} of {} keyframes nearly everything was occluded, or much moved: the search for "
             "audible sources ended early there, with the right mean loudness but fewer voices\n",
             played.bounded_keyframes, played.keyframes);
}

void print_unseen_sources(std::uint32_t most, std::ostream& err) {
  if (most == 0) return;
  fmt::print(err, "{} without reflections, inside solids or where no probe is seen\n",
             most == 1 ? "1 moving source was" : fmt::format("up to {} moving sources were", most));
}

void print_pages(const PageStatistics& pages, std::ostream& err) {
  if (pages.loaded > 0)
    fmt::print(err, "pages: {} requested, {} loaded, {} evicted, {} late; {:.1f} MB in memory\n",
               pages.asked, pages.loaded, pages.dropped, pages.late,
               static_cast<double>(pages.bytes) / 1e6);
  if (pages.failed > 0)
    fmt::print(err, "{} pages could not be read; the samples of their parent pages replaced them\n",
               pages.failed);
}

void print_sounds(const SoundStatistics& sounds, std::uint64_t keyframes, std::ostream& err) {
  if (sounds.loaded > 0)
    fmt::print(err, "sounds: {} blocks decoded, {} evicted; {:.1f} of {:.1f} MB in memory{}\n",
               sounds.loaded, sounds.dropped, static_cast<double>(sounds.bytes) / 1e6,
               static_cast<double>(sounds.all_bytes) / 1e6,
               sounds.lock_refused ? fmt::format(", {:.1f} MB locked; 'ulimit -l' allows no more",
                                                 static_cast<double>(sounds.locked_bytes) / 1e6)
                                   : "");
  if (sounds.handed_over > 0)
    fmt::print(err,
               "in {} of {} keyframes, sources whose sound was not in memory left their voices to "
               "others\n",
               sounds.handed_over, keyframes);
  if (sounds.late > 0)
    fmt::print(err, "{} times a voice was silent for 20 ms because its sound was not decoded yet\n",
               sounds.late);
  if (sounds.over_budget > 0)
    fmt::print(err, "{} times a sound did not fit into memory; {} holds all\n", sounds.over_budget,
               memory_for_all(sounds));
  if (sounds.failed > 0)
    fmt::print(err, "{} blocks of sounds could not be read and were silent\n", sounds.failed);
}

}  // namespace

void print_play_summary(const PlayerStatistics& played, const PlayHistory& history,
                        std::span<const ThreadCpuUsage> threads, std::ostream& err) {
  const AuralizerStatistics& auralizer = played.auralizer;
  fmt::print(err,
             "played {:.1f} s: {} callbacks, {} late, {} gaps, {} blocks held, {} frames "
             "clipped{}\n",
             played.time_s, played.output.callbacks.callbacks, played.output.callbacks.late,
             played.output.callbacks.underflows, auralizer.held_blocks, auralizer.clipped_frames,
             limited_note(auralizer.limited));
  fmt::print(err, "voices: {:.0f} on average, {} at minimum; {:.1f} LUFS on average\n",
             history.mean_voices(), history.min_voices(), std::max(history.loudness_lufs(), -99.9));
  print_device(played.output, err);
  print_threads(threads, err);
  print_overload(auralizer, err);
  print_bounded_search(auralizer, err);
  print_unseen_sources(auralizer.max_unseen_sources, err);
  print_pages(auralizer.pages, err);
  print_sounds(auralizer.sounds, auralizer.keyframes, err);
}

}  // namespace clamor
