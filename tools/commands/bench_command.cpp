// bench_command.cpp: clamor bench: measures how many voices one core mixes.
#include <algorithm>
#include <charconv>
#include <ostream>

#include <fmt/format.h>

#include "tools/analysis/json_values.h"
#include "tools/bench/bench_voices.h"
#include "tools/bench/mixer_benchmark.h"
#include "tools/commands/commands.h"
#include "tools/program/arguments.h"
#include "tools/program/progress.h"
#include "tools/program/quiet_option.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

using What = MixerTiming::What;

// 10^6 voices take 1.5 GB.
constexpr std::uint32_t kMaxVoices = 1'000'000;

// Parses "150,2000".
Result<std::vector<std::uint32_t>> parse_voices(const std::string& text) {
  std::vector<std::uint32_t> counts;
  for (const char *at = text.data(), *const end = at + text.size();; ++at) {
    std::uint32_t count = 0;
    const auto read = std::from_chars(at, end, count);
    if (read.ec != std::errc() || count == 0 || count > kMaxVoices ||
        (read.ptr != end && *read.ptr != ','))
      return Error(
          fmt::format("--voices takes whole numbers from 1 to {}, separated by commas, "
                      "not {}",
                      kMaxVoices, in_quotes(text)));
    counts.push_back(count);
    at = read.ptr;
    if (at == end) return counts;
  }
}

const char* curve_of(const MixMode& mode) {
  return mode.interpolation == Interpolation::kCubic ? "cubic" : "linear";
}
const char* bands_of(const MixMode& mode) { return mode.two_layers() ? "eight" : "full"; }
const char* output_of(OpenalOutput output) {
  return output == OpenalOutput::kBinaural ? "binaural" : "stereo";
}
const char* output_of(const MixMode& mode) {
  return output_of(mode.head ? OpenalOutput::kBinaural : OpenalOutput::kStereo);
}
std::string name_of(const MixMode& mode) {
  return fmt::format("{:<7}{:<7}{:<7}{:<9}", curve_of(mode), mode.delays == 1 ? "one" : "two",
                     bands_of(mode), output_of(mode));
}
const std::string kNameColumns =
    fmt::format("{:<7}{:<7}{:<7}{:<9}", "interp", "delays", "bands", "output");

bool same(const MixMode& a, const MixMode& b) { return name_of(a) == name_of(b); }

const MixerTiming* find(const MixerBenchmark& figures, What what, const MixMode& mode,
                        const std::string& instructions, std::uint32_t voices) {
  for (const MixerTiming& figure : figures.figures)
    if (figure.what == what && same(figure.mode, mode) && figure.voices == voices &&
        (what != What::kKernel || figure.instructions == instructions))
      return &figure;
  return nullptr;
}

void print_by_voices(const MixerBenchmark& figures, What what, const std::string& title,
                     const std::vector<std::uint32_t>& counts, std::ostream& out) {
  out << '\n' << title << '\n' << kNameColumns;
  for (const std::uint32_t count : counts) out << fmt::format("{:>11}", "K=" + grouped(count));
  if (what == What::kKernel) out << "   multiply-adds  loads";
  out << '\n';
  for (const MixMode& mode : bench_modes()) {
    std::string line;
    const MixerTiming* best = nullptr;
    for (const std::uint32_t count : counts) {
      const MixerTiming* figure = find(figures, what, mode, figures.instructions, count);
      if (figure == nullptr) continue;
      line += fmt::format("{:>11}", grouped(figure->real_time.best));
      if (best == nullptr || best->real_time.best < figure->real_time.best) best = figure;
    }
    if (line.empty()) continue;
    out << name_of(mode) << line;
    if (what == What::kKernel)
      out << fmt::format("{:>14.0f} %{:>6.0f} %", 100 * best->of_multiply_adds,
                         100 * best->of_loads);
    out << '\n';
  }
}

void print_by_instructions(const MixerBenchmark& figures, std::ostream& out) {
  std::vector<std::string> targets = {figures.instructions};
  std::uint32_t voices = 0;
  for (const MixerTiming& figure : figures.figures)
    if (figure.what == What::kKernel && figure.instructions != figures.instructions) {
      voices = figure.voices;
      if (std::find(targets.begin(), targets.end(), figure.instructions) == targets.end())
        targets.push_back(figure.instructions);
    }
  if (voices == 0) return;
  out << fmt::format("\nThe kernel in other instruction sets, K={}\n{}", grouped(voices),
                     kNameColumns);
  for (const std::string& target : targets) out << fmt::format("{:>11}", target);
  out << '\n';
  for (const MixMode& mode : bench_modes()) {
    out << name_of(mode);
    for (const std::string& target : targets) {
      const MixerTiming* figure = find(figures, What::kKernel, mode, target, voices);
      out << fmt::format("{:>11}", figure ? grouped(figure->real_time.best) : "");
    }
    out << '\n';
  }
}

// The profile of the same mode in full band.
const KernelProfile& full_band(const MixerBenchmark& figures, const KernelProfile& profile) {
  MixMode full = profile.mode;
  full.eight_bands = full.head = false;
  return *std::ranges::find_if(figures.profiles, [&](const KernelProfile& other) {
    return same(other.mode, full) && other.voices == profile.voices;
  });
}

void print_profiles(const MixerBenchmark& figures, std::ostream& out) {
  if (figures.profiles.empty()) return;
  out << "\nTime of one voice per block, in ns. reading, buses: multiply-adds at the core's peak "
         "rate, "
         "for interpolating the signal and\nfor adding it to the buses with ramped gains. other: "
         "what "
         "static voices in L1 take beyond that. setup: once per voice and\ncall. memory: cache "
         "misses. "
         "sliding: moving delays. keyframes: loading keyframes and filtering the bands, in the "
         "whole\n"
         "mixer. peak: share of reading and buses in the kernel's time. times: kernel time "
         "relative to "
         "a full-band voice; at peak: if\nboth ran at the peak rate.\n"
      << kNameColumns
      << fmt::format("{:>7}{:>9}{:>8}{:>7}{:>8}{:>8}{:>9}{:>11}{:>9}{:>7}{:>9}\n", "K", "reading",
                     "buses", "other", "setup", "memory", "sliding", "keyframes", "peak", "times",
                     "at peak");
  for (const KernelProfile& profile : figures.profiles) {
    const KernelProfile& full = full_band(figures, profile);
    out << name_of(profile.mode) << fmt::format("{:>7}", grouped(profile.voices));
    const auto block_ns = [](double frame_ns) { return kBenchFrames * frame_ns; };
    out << fmt::format(
        "{:>9.1f}{:>8.1f}{:>7.1f}{:>8.1f}{:>8.1f}{:>9.1f}{:>11.1f}{:>7.0f} %{:>7.2f}{:>9.2f}\n",
        block_ns(profile.reading_ns), block_ns(profile.ceiling_ns - profile.reading_ns),
        block_ns(profile.rest_ns()), block_ns(profile.taking_ns()), block_ns(profile.memory_ns()),
        block_ns(profile.sliding_ns()), block_ns(profile.keyframes_ns()),
        100 * profile.ceiling_ns / profile.usual_ns, profile.usual_ns / full.usual_ns,
        profile.ceiling_ns / full.ceiling_ns);
  }
}

void print_fields(const MixerBenchmark& figures, std::ostream& out) {
  out << fmt::format(
             "\nTaps of a field instead of voices: {} signals with responses of a second, for a "
             "listener who walks at 1.5 m/s.\nrenewal: of one tap at one ear, in ns. convolution: "
             "of a signal's response at one ear, in % of a core. all: in % of a\ncore. real time: "
             "as many taps as would take all of it.\n",
             kBenchSignals)
      << kNameColumns
      << fmt::format("{:>7}{:>9}{:>13}{:>8}{:>11}\n", "K", "renewal", "convolution", "all",
                     "real time");
  for (const FieldTiming& field : figures.fields)
    out << name_of(field.mode)
        << fmt::format("{:>7}{:>9.1f}{:>11.2f} %{:>6.1f} %{:>11}\n", grouped(field.taps),
                       field.renewal_ns, 100 * field.convolution_s, 100 * field.cpu_s,
                       grouped(field.real_time_taps()));
}

void print_openal(const MixerBenchmark& figures, std::ostream& out) {
  const OpenalLibrary& openal = figures.openal;
  if (openal.version.empty()) {
    out << "\nOpenAL Soft is not installed, so there is no comparison; install libopenal-dev and "
           "build "
           "again.\n";
    return;
  }
  const auto like = [&](OpenalOutput output) {
    return curve_of(mode_like_openal(openal.resampler, output));
  };
  out << fmt::format(
      "\nOpenAL Soft {} on the same voices, and how many times more voices Clamor mixes. Its "
      "defaults: resampler {}, output at\n{} Hz, HRTF {}. stereo: with these defaults and no "
      "HRTF, against Clamor {}, one delay, full band.\n",
      openal.version, openal.resampler, openal.output_hz, openal.hrtf_by_default,
      like(OpenalOutput::kStereo));
  if (figures.openal_head.empty())
    out << "It has no HRTF here, so binaural mixing is not compared.\n";
  else
    out << fmt::format(
        "binaural: with its HRTF {}, against Clamor {}, two delays, eight bands, and an HRTF in {} "
        "narrow bands\nfor the {} loudest voices.\n",
        in_quotes(figures.openal_head), like(OpenalOutput::kBinaural), kHrtfBands,
        MixMode().narrowband_voices);
  out << fmt::format("{:<10}{:>10}{:>12}{:>18}{:>12}{:>18}\n", "output", "", "static",
                     "times: kernel", "moving", "times: mixer");
  for (const OpenalTiming& figure : figures.against_openal)
    out << fmt::format("{:<10}{:>10}{:>12}{:>18.1f}{:>12}{:>18.1f}\n", output_of(figure.output),
                       "K=" + grouped(figure.voices), grouped(figure.still), figure.times_still,
                       grouped(figure.moving), figure.times_moving);
}

void print_tables(const MixerBenchmark& figures, const std::vector<std::uint32_t>& counts,
                  std::ostream& out) {
  out << fmt::format(
      "Voices in real time on one core: 48 kHz, blocks of 256 frames, K voices at once, {}.\n"
      "Figures are the best of the runs, which other programs disturb least; --json has medians, "
      "too.\n",
      figures.instructions);
  print_by_voices(figures, What::kMixer,
                  "The mixer: keyframes loaded, voices placed and mixed, bands filtered", counts,
                  out);
  print_by_voices(
      figures, What::kKernel,
      "The kernel alone, and its share of this core's peak of multiply-adds and of loads", counts,
      out);
  print_by_voices(figures, What::kReference, "The reference: frame by frame, in double", counts,
                  out);
  print_by_instructions(figures, out);
  print_profiles(figures, out);
  print_fields(figures, out);
  print_openal(figures, out);
}

OrderedJson to_json(const MixerBenchmark& figures) {
  OrderedJson json = {{"rate_hz", 48000},
                      {"frames", 256},
                      {"instructions", figures.instructions},
                      {"peak",
                       {{"multiply_adds_per_s", figures.peak_multiply_adds_per_s},
                        {"loads_per_s", figures.peak_loads_per_s}}}};
  json["figures"] = OrderedJson::array();
  for (const MixerTiming& figure : figures.figures) {
    OrderedJson one = {{"what", figure.what == What::kMixer    ? "mixer"
                                : figure.what == What::kKernel ? "kernel"
                                                               : "reference"},
                       {"instructions", figure.instructions},
                       {"curve", curve_of(figure.mode)},
                       {"delays", figure.mode.delays},
                       {"bands", figure.mode.two_layers() ? 8 : 1},
                       {"output", output_of(figure.mode)},
                       {"voices", figure.voices},
                       {"real_time_voices", figure.real_time.best},
                       {"median_real_time_voices", figure.real_time.median}};
    if (figure.what == What::kKernel) {
      one["multiply_adds_per_frame"] = figure.work.multiply_adds;
      one["loads_per_frame"] = figure.work.loads;
      one["of_multiply_adds"] = figure.of_multiply_adds;
      one["of_loads"] = figure.of_loads;
    }
    json["figures"].push_back(std::move(one));
  }
  json["profiles"] = OrderedJson::array();
  for (const KernelProfile& profile : figures.profiles)
    json["profiles"].push_back({{"curve", curve_of(profile.mode)},
                                {"delays", profile.mode.delays},
                                {"bands", profile.mode.two_layers() ? 8 : 1},
                                {"output", output_of(profile.mode)},
                                {"voices", profile.voices},
                                {"reading_ns", profile.reading_ns},
                                {"ceiling_ns", profile.ceiling_ns},
                                {"taking_ns", profile.taking_ns()},
                                {"still_and_near_ns", profile.still_and_near_ns},
                                {"still_ns", profile.still_ns},
                                {"usual_ns", profile.usual_ns},
                                {"mixer_ns", profile.mixer_ns}});
  json["fields"] = OrderedJson::array();
  for (const FieldTiming& field : figures.fields)
    json["fields"].push_back({{"output", output_of(field.mode)},
                              {"taps", field.taps},
                              {"renewal_ns_per_tap_and_ear", field.renewal_ns},
                              {"convolution_s_per_signal_and_ear", field.convolution_s},
                              {"cpu_s", field.cpu_s},
                              {"real_time_taps", field.real_time_taps()}});
  json["openal"] = nullptr;
  const OpenalLibrary& openal = figures.openal;
  if (openal.version.empty()) return json;
  json["openal"] = {{"version", openal.version},     {"resampler", openal.resampler},
                    {"output_hz", openal.output_hz}, {"hrtf_by_default", openal.hrtf_by_default},
                    {"head", figures.openal_head},   {"figures", OrderedJson::array()}};
  for (const OpenalTiming& figure : figures.against_openal)
    json["openal"]["figures"].push_back({{"output", output_of(figure.output)},
                                         {"voices", figure.voices},
                                         {"still", figure.still},
                                         {"moving", figure.moving},
                                         {"times_still", figure.times_still},
                                         {"times_moving", figure.times_moving}});
  return json;
}

}  // namespace

int run_bench(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string what, voices = "150,2000,20000,100000";
  BenchRequest request;
  bool json = false;
  Arguments parser(
      "bench",
      "Measures how many voices one core of this machine mixes in real time, by CPU time: the "
      "whole "
      "mixer and its kernel alone, for each mixing mode; the kernel's share of the core's peak and "
      "where the rest of its time goes; the double-precision reference; other instruction sets; "
      "taps of a field; and OpenAL Soft on the same voices. Takes a few minutes.",
      "clamor bench mixer --voices 2000");
  parser.positional("WHAT", what, "mixer");
  parser.words("WHAT", {"mixer"});
  parser.option("--voices", voices, "numbers of voices to mix at once, one column each");
  parser.option("--cpu-seconds", request.seconds, "minimum CPU time of each run");
  parser.option("--runs", request.runs, "runs of each figure; the best counts");
  parser.within("--runs", request.runs, 1, 1000);
  parser.flag("--json", json, "print JSON, with medians as well");
  QuietOption quiet(parser);
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  if (what != "mixer")
    return parser.bad_usage(err, "only the mixer can be measured, not " + in_quotes(what));
  if (!(request.seconds > 0 && request.seconds <= 60))
    return parser.bad_usage(err, "--cpu-seconds must lie above 0 and below 60");
  const auto counts = parse_voices(voices);
  if (!counts) return parser.bad_usage(err, counts.error().message);
  request.voices = *counts;

  Result<MixerBenchmark> figures = [&] {
    Progress progress(quiet.notes(err), "  timing");
    return measure_mixer(request, [&](double share) { progress.update(share, {}); });
  }();
  if (!figures) return parser.end(err, figures.error());
  if (json)
    out << to_json(*figures).dump(2) << '\n';
  else
    print_tables(*figures, request.voices, out);
  return kSuccess;
}

}  // namespace clamor
