#include "tools/commands/play_summary.h"

#include <algorithm>
#include <ostream>
#include <string>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "runtime/engine/auralizer_statistics.h"
#include "runtime/player/player_statistics.h"
#include "runtime/realtime/thread_cpu_usage.h"
#include "tools/commands/play_status.h"

namespace clamor {

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
