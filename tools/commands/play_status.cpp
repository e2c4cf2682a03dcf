#include "tools/commands/play_status.h"

#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "tools/program/printable_stream.h"

namespace clamor {

namespace {

std::string times(std::uint64_t count) {
  return count == 1 ? "once" : fmt::format("{} times", count);
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

void DeviceNotices::tell(const OutputStatistics& output) {
  if (output.device == "none" && output.problem.empty()) return;
  if (had_device_ == output.has_device) return;
  had_device_ = output.has_device;
  if (over_line_) err_ << to_line_start << clear_rest_of_line;
  if (output.has_device)
    fmt::print(err_, "sound is back, on {}\n", describe(output));
  else
    fmt::print(err_, "no sound from the device ({}); time goes on, and it is tried again\n",
               output.problem);
}

std::string device_note(const OutputStatistics& output) {
  if (output.has_device || output.problem.empty()) return "";
  return fmt::format("  NO DEVICE for {:.1f} s", output.without_device_now_s);
}

void report(const OutputStatistics& output, std::ostream& err) {
  if (output.device == "none" && output.problem.empty()) return;
  fmt::print(err, "device: {}", describe(output));
  if (output.losses > 0) fmt::print(err, ", lost {}", times(output.losses));
  if (output.reopenings > 0) fmt::print(err, ", opened again {}", times(output.reopenings));
  if (output.without_device_s > 0)
    fmt::print(err, ", {:.1f} s without it, {:.1f} s at the longest", output.without_device_s,
               output.longest_without_s);
  fmt::print(err, "\n");
  if (output.failed_openings > 0)
    fmt::print(err, "        opening it failed {}: {}\n", times(output.failed_openings),
               output.opening_problem);
  if (output.hung_closings > 0)
    fmt::print(err, "        closing it hung {} and was left to itself\n",
               times(output.hung_closings));
}

void report(std::span<const ThreadCpuUsage> threads, std::ostream& err) {
  constexpr double kWorthALine = 5e-4;
  fmt::print(err, "CPU, of one core: ");
  double sum = 0;
  for (const ThreadCpuUsage& thread : threads) {
    sum += thread.share;
    if (thread.share > kWorthALine)
      fmt::print(err, "{} {:.1f} %, ", thread.name, 100 * thread.share);
  }
  fmt::print(err, "in all {:.1f} %\n", 100 * sum);
}

}  // namespace clamor
