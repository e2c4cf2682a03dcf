#include "tools/commands/play_history.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "runtime/engine/auralizer_statistics.h"
#include "runtime/player/player_statistics.h"
#include "runtime/realtime/thread_cpu_usage.h"

namespace clamor {

namespace {

constexpr const char* kName = "play";  // prefix of the files of the report
constexpr double kBetween_s = 0.1;
constexpr std::size_t kMaxMoments = 360'000;

std::uint32_t sounding(const AuralizerStatistics& now) {
  return now.voices - std::min(now.voices, now.shed_voices);
}

}  // namespace

void PlayHistory::add(const PlayerStatistics& now, const Listener& listener) {
  if (now.time_s <= 0 || moments_.size() == kMaxMoments) return;
  if (!moments_.empty() && now.time_s < moments_.back().time_s + kBetween_s) return;
  moments_.push_back({now.time_s, listener.position_m, now.momentary_lufs, now.short_term_lufs,
                      sounding(now.auralizer), now.auralizer.k, now.output.callbacks.cpu_share,
                      now.auralizer.sampler_ms, now.output.callbacks.late,
                      now.auralizer.held_blocks});
}

double PlayHistory::mean_voices() const {
  double sum = 0;
  for (const Moment& moment : moments_) sum += moment.voices;
  return moments_.empty() ? 0 : sum / static_cast<double>(moments_.size());
}

std::uint32_t PlayHistory::min_voices() const {
  const auto fewest =
      std::min_element(moments_.begin(), moments_.end(),
                       [](const Moment& a, const Moment& b) { return a.voices < b.voices; });
  return fewest == moments_.end() ? 0 : fewest->voices;
}

double PlayHistory::loudness_lufs() const {
  double power = 0;
  for (const Moment& moment : moments_) power += std::pow(10, moment.momentary_lufs / 10);
  return moments_.empty() ? -std::numeric_limits<double>::infinity()
                          : 10 * std::log10(power / static_cast<double>(moments_.size()));
}

Result<void> PlayHistory::check_folder(const std::string& folder, const InputFiles& inputs) {
  return ReportPage::check_folder(folder, kName, inputs);
}

ReportTable PlayHistory::figures_of(const PlayerStatistics& played) const {
  ReportTable figures{"figures", "Totals", {"what", "value"}, {}};
  const auto row = [&figures](const char* what, double value) {
    figures.rows.push_back({std::string(what), value});
  };
  row("seconds", played.time_s);
  row("callbacks", static_cast<double>(played.output.callbacks.callbacks));
  row("late_callbacks", static_cast<double>(played.output.callbacks.late));
  row("gaps", static_cast<double>(played.output.callbacks.underflows));
  row("device_latency_ms", 1e3 * played.output.latency_s);
  row("held_blocks", static_cast<double>(played.auralizer.held_blocks));
  row("late_keyframes", static_cast<double>(played.auralizer.late_keyframes));
  row("starved_keyframes", static_cast<double>(played.auralizer.starved_keyframes));
  row("max_lead_ms", 1e3 * played.auralizer.max_lead_s);
  row("bounded_keyframes", static_cast<double>(played.auralizer.bounded_keyframes));
  row("mean_voices", mean_voices());
  row("min_voices", min_voices());
  row("loudness_lufs", std::max(loudness_lufs(), -99.9));
  row("clipped_frames", static_cast<double>(played.auralizer.clipped_frames));
  row("limited_frames", static_cast<double>(played.auralizer.limited.frames));
  return figures;
}

Result<void> PlayHistory::write(const std::string& folder, const std::string& level,
                                const PlayerStatistics& played,
                                std::span<const ThreadCpuUsage> threads,
                                const std::optional<Spectrogram>& heard) const {
  ReportPage report(
      kName, "Playback report",
      fmt::format("{}, {:.1f} s, on {}", level, played.time_s,
                  played.output.device == "none" ? "no device" : played.output.device));
  Chart loudness{.title = "Loudness (BS.1770)", .x_label = "time (s)", .y_label = "LUFS"};
  Chart voices{.title = "Voices", .x_label = "time (s)", .y_label = "voices"};
  Chart load{.title = "Time that mixing takes", .x_label = "time (s)", .y_label = "% of a block"};
  using Look = Chart::Series::Look;
  loudness.series = {{"momentary, 400 ms", {}, Look::kThin}, {"short-term, 3 s", {}, Look::kLine}};
  voices.series = {{"mixed", {}, Look::kLine}, {"chosen", {}, Look::kDashes}};
  load.series = {{"", {}, Look::kLine}};
  ReportTable table{"moments", "Ten times a second", {}, {}, true};
  table.columns = {"time_s",
                   "x_m",
                   "y_m",
                   "z_m",
                   "momentary_lufs",
                   "short_term_lufs",
                   "voices",
                   "chosen",
                   "mixing_percent",
                   "sampler_ms",
                   "late_callbacks",
                   "held_blocks"};
  for (const Moment& at : moments_) {
    loudness.series[0].points.emplace_back(at.time_s, at.momentary_lufs);
    loudness.series[1].points.emplace_back(at.time_s, at.short_term_lufs);
    voices.series[0].points.emplace_back(at.time_s, at.voices);
    voices.series[1].points.emplace_back(at.time_s, at.k);
    load.series[0].points.emplace_back(at.time_s, 100 * at.audio_share);
    table.rows.push_back({at.time_s, at.position_m.x, at.position_m.y, at.position_m.z,
                          std::max(at.momentary_lufs, -99.9), std::max(at.short_term_lufs, -99.9),
                          static_cast<double>(at.voices), static_cast<double>(at.k),
                          100 * at.audio_share, at.sampler_ms,
                          static_cast<double>(at.late_callbacks),
                          static_cast<double>(at.held_blocks)});
  }
  report.chart(loudness, "K-weighted, of all channels.");
  if (heard)
    report.spectrogram(
        *heard, "Spectrogram",
        "Mean power of all channels in each third of an octave, relative to full scale.");
  else
    report.paragraph("With --record FILE, the report has a spectrogram, too.");
  report.chart(voices, "Voices that fade out are mixed, too, so more are mixed than chosen.");
  report.chart(load, "On the audio thread, smoothed over a second.");

  report.table(figures_of(played));
  ReportTable cpu{"threads", "CPU, share of one core", {"thread", "percent"}, {}};
  for (const ThreadCpuUsage& thread : threads)
    cpu.rows.push_back({thread.name, 100 * thread.share});
  report.table(std::move(cpu));
  report.table(std::move(table));
  return report.write(folder);
}

}  // namespace clamor
