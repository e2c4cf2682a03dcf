// compare_command.cpp: clamor compare: audible differences between two recordings.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <ostream>
#include <vector>

#include <fmt/format.h>

#include "common/sample_rate.h"
#include "common/utf8_path.h"
#include "formats/audio/audio_file.h"
#include "tools/analysis/json_values.h"
#include "tools/analysis/null_distribution.h"
#include "tools/analysis/random_texture.h"
#include "tools/analysis/sound_comparison.h"
#include "tools/analysis/time_varying_part.h"
#include "tools/commands/commands.h"
#include "tools/commands/compare_table.h"
#include "tools/program/arguments.h"
#include "tools/program/interrupt.h"
#include "tools/program/progress.h"
#include "tools/program/quiet_option.h"
#include "tools/program/stage_notice.h"

namespace clamor {

namespace {

constexpr float kMaxSample = 1e6f;
constexpr int kMaxRolls = 10000, kMaxChannelsCompared = 2;
constexpr std::size_t kMaxPointsInJson = 64;  // longer lists, such as moments, are left out

struct Options {
  std::string a, b, rolls_folder, dry;
  std::optional<SoundKind> kind;  // unset: that which both look like
  int null_rolls = 0;
  std::uint64_t seed = 1;
  bool json = false;
};

Result<Sound> read_sound(const std::string& path) {
  Result<Sound> sound = read_channels(path, kMaxChannelsCompared);
  if (!sound.ok()) return sound;
  for (const auto& channel : sound->channels)
    for (const float x : channel)
      if (std::abs(x) > kMaxSample)
        return Error(fmt::format("reaches {:g}, where full scale is 1; lower it.", x)).in(path);
  return sound;
}

// Reads a sound that must have as many channels as another.
Result<Sound> read_alike(const std::string& path, const std::string& other_path,
                         const Sound& other) {
  const auto kind = [](const Sound& sound) {
    return sound.channels.size() == 1 ? "mono" : "stereo";
  };
  Result<Sound> sound = read_sound(path);
  if (sound.ok() && sound->channels.size() != other.channels.size())
    return Error(fmt::format("is {}, but {} is {}; give two of the same number of channels.",
                             kind(*sound), in_quotes(other_path), kind(other)))
        .in(path);
  return sound;
}

OrderedJson to_json(const DifferencePoint& point, const MeasureInfo& info) {
  OrderedJson json;
  if (std::string_view(info.place) == "Hz") json["hz"] = point.at;
  if (std::string_view(info.place) == "s") json["s"] = point.at;
  if (point.channel) json["channel"] = *point.channel;
  json["a"] = as_json(point.a);
  json["b"] = as_json(point.b);
  json["difference"] = as_json(point.difference);
  json["jnd"] = info.jnd ? OrderedJson(point.jnd) : OrderedJson();
  json["judged"] = point.judged;
  return json;
}

OrderedJson to_json(const Difference& difference, const NullDistribution* null) {
  const MeasureInfo& info = *difference.info;
  const DifferencePoint* const worst = difference.worst();
  OrderedJson json = to_json(worst == nullptr ? DifferencePoint{} : *worst, info);
  json.erase("judged");
  if (worst == nullptr) json["jnd"] = as_json(info.jnd);
  if (null != nullptr)
    json["null_95"] =
        worst == nullptr ? OrderedJson() : OrderedJson(chance_95(*null, difference, worst->jnd));
  const std::string heard = verdict_on(difference, null);
  json["verdict"] = heard.empty() ? OrderedJson() : OrderedJson(heard);
  json["value_unit"] = info.value_unit;
  json["unit"] = info.unit;
  json["source"] = info.source;
  json["jnd_source"] = info.jnd_source;
  if (difference.points.size() > 1 && difference.points.size() <= kMaxPointsInJson)
    for (const DifferencePoint& point : difference.points)
      json["points"].push_back(to_json(point, info));
  return json;
}

OrderedJson to_json(const std::string& path, const Sound& sound) {
  return {{"file", path},
          {"seconds", static_cast<double>(sound.frames()) / kSampleRate_hz},
          {"channels", sound.channels.size()},
          {"rate_hz", sound.file_rate_hz}};
}

// Calls difference_of_roll() on all cores and shows the progress.
NullDistribution with_progress(
    int count, const std::function<std::vector<Difference>(std::uint32_t)>& difference_of_roll,
    std::ostream& err) {
  Progress progress(err, "  chance");
  std::mutex printing;
  int done = 0;
  return null_distribution(count, [&](std::uint32_t roll) {
    std::vector<Difference> differences = difference_of_roll(roll);
    const std::scoped_lock lock(printing);
    progress.update(static_cast<double>(++done) / count, {fmt::format("{} of {}", done, count)});
    return differences;
  });
}

NullDistribution null_of_texture(const Options& options, const SoundAnalysis& a,
                                 std::ostream& err) {
  const RandomTexture texture(a.sound);
  const auto pair = [&](std::uint32_t roll) {
    return compare(analyse(texture.roll(options.seed, 2 * roll), a.kind),
                   analyse(texture.roll(options.seed, 2 * roll + 1), a.kind));
  };
  return with_progress(options.null_rolls, pair, err);
}

// Null distribution from a folder of exact renderings with other phases.
Result<NullDistribution> null_of_folder(const Options& options, const SoundAnalysis& a,
                                        std::ostream& err) {
  const std::string& folder = options.rolls_folder;
  std::vector<std::string> paths;
  std::error_code problem;
  for (std::filesystem::directory_iterator file(path_of(folder), problem), end;
       !problem && file != end; file.increment(problem))
    if (std::error_code ignored; file->is_regular_file(ignored))
      paths.push_back(file->path().string());
  if (problem)
    return Error(fmt::format("cannot be read as a folder ({}); give one that holds exact "
                             "renderings with other phases.",
                             problem.message()))
        .in(folder);
  std::sort(paths.begin(), paths.end());
  if (paths.size() < static_cast<std::size_t>(kMinRolls))
    return Error(fmt::format("holds {} files; a 95th percentile takes {} exact renderings with "
                             "other phases.",
                             paths.size(), kMinRolls))
        .in(folder);

  std::mutex failing;
  std::optional<Error> first;
  const auto roll = [&](std::uint32_t i) {
    Result<Sound> sound = read_alike(paths[i], options.a, a.sound);
    if (sound.ok()) {
      for (auto& channel : sound->channels) channel.resize(a.sound.frames());
      return compare(a, analyse(std::move(*sound), a.kind));
    }
    const std::scoped_lock lock(failing);
    if (!first) first = sound.error();
    return compare(a, a);
  };
  const NullDistribution null = with_progress(static_cast<int>(paths.size()), roll, err);
  if (first) return *first;
  return null;
}

// Reads the dry signal and repeats it to the length of the recordings.
Result<std::vector<float>> read_dry(const std::string& path, std::size_t frames) {
  Result<std::vector<float>> signal = read_audio(path);
  if (!signal.ok()) return signal;
  if (std::all_of(signal->begin(), signal->end(), [](float x) { return x == 0; }))
    return Error("is silent; give the signal that plays in both recordings.").in(path);
  const double seconds = static_cast<double>(frames) / kSampleRate_hz;
  if (seconds < kMinSoundForFilter_s)
    return Error(
        fmt::format("--dry takes recordings of at least {:g} s, and these have {:.2f} s; "
                    "render more.",
                    kMinSoundForFilter_s, seconds));
  std::vector<float> dry(frames);
  for (std::size_t i = 0; i < frames; ++i) dry[i] = (*signal)[i % signal->size()];
  return dry;
}

void print_json(const Options& options, OrderedJson json,
                const std::vector<Difference>& differences, const NullDistribution* null,
                std::ostream& out) {
  if (options.null_rolls > 0)
    json["null"] = {{"rolls", options.null_rolls}, {"seed", options.seed}};
  else if (null != nullptr)
    json["null"] = {{"rolls", null->count()}, {"folder", options.rolls_folder}};
  json["audible"] = OrderedJson::array();
  if (null != nullptr) json["beyond_chance"] = OrderedJson::array();
  for (const Difference& difference : differences) {
    const std::string heard = verdict_on(difference, null);
    if (heard == "audible") json["audible"].push_back(difference.info->key);
    if (heard == "beyond chance") json["beyond_chance"].push_back(difference.info->key);
    json["measures"][difference.info->key] = to_json(difference, null);
  }
  out << json_text(json) << '\n';
}

Result<void> run(const Options& options, std::ostream& out, std::ostream& notes) {
  Result<Sound> a = read_sound(options.a);
  if (!a) return a.error();
  Result<Sound> b = read_alike(options.b, options.a, *a);
  if (!b) return b.error();

  const bool decays =
      !options.kind && looks_like_impulse_response(*a) && looks_like_impulse_response(*b);
  const SoundKind kind =
      options.kind.value_or(decays ? SoundKind::kImpulseResponse : SoundKind::kProgramme);
  const bool response = kind == SoundKind::kImpulseResponse;
  OrderedJson json;
  json["a"] = to_json(options.a, *a);
  json["b"] = to_json(options.b, *b);
  json["kind"] = response ? "response" : "programme";

  const auto seconds = [](std::size_t frames) {
    return static_cast<double>(frames) / kSampleRate_hz;
  };
  const std::size_t frames = std::max(a->frames(), b->frames());
  if (a->frames() != b->frames())
    notes << fmt::format("A has {:.3f} s and B {:.3f} s; the shorter is padded with silence.\n",
                         seconds(a->frames()), seconds(b->frames()));
  for (Sound* const sound : {&*a, &*b})
    for (auto& channel : sound->channels) channel.resize(frames);

  std::vector<float> dry;
  if (!options.dry.empty()) {
    Result<std::vector<float>> read = read_dry(options.dry, frames);
    if (!read) return read.error();
    dry = std::move(*read);
  }
  StageNotice notice(notes);
  notice.begin("analysing both sounds");
  const SoundAnalysis analysis_a = analyse(std::move(*a), kind);
  const SoundAnalysis analysis_b = analyse(std::move(*b), kind);
  std::vector<Difference> differences = compare(analysis_a, analysis_b);
  if (!dry.empty())
    differences.push_back(compare_time_varying_parts(dry, analysis_a.sound, analysis_b.sound));
  notice.end();
  std::optional<NullDistribution> null;
  if (options.null_rolls > 0) null = null_of_texture(options, analysis_a, notes);
  if (!options.rolls_folder.empty()) {
    const Result<NullDistribution> of_folder = null_of_folder(options, analysis_a, notes);
    if (!of_folder) return of_folder.error();
    null = *of_folder;
  }
  const NullDistribution* const yardstick = null ? &*null : nullptr;

  if (!options.json) {
    out << fmt::format("A {}\nB {}\n{:.2f} s, {}, compared as {}\n\n", options.a, options.b,
                       seconds(frames), analysis_a.ears.size() == 1 ? "mono" : "stereo",
                       response ? "impulse responses" : "programmes");
    print_comparison(options.a, options.b, differences, yardstick, out);
    return {};
  }
  print_json(options, std::move(json), differences, yardstick, out);
  return {};
}

}  // namespace

int run_compare(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  Options options;
  Arguments parser("compare", compare_help(),
                   "clamor compare exact.wav approximation.wav --null 100");
  parser.positional("A", options.a, "the reference: WAV, FLAC, Ogg or MP3");
  parser.positional("B", options.b, "the recording to compare with it");
  parser.choice("--as", options.kind,
                {{"auto", std::nullopt},
                 {"programme", SoundKind::kProgramme},
                 {"response", SoundKind::kImpulseResponse}},
                "programme or response; auto: response if both begin at once and decay");
  parser.option("--null", options.null_rolls,
                "for textures: pairs of noise to draw, 19 to 10000, 100 is enough; 0: none");
  parser.option("--seed", options.seed, "seed of --null");
  parser.option("--rolls", options.rolls_folder,
                "for textures: folder of at least 19 exact renderings with other phases ('clamor "
                "render --strategy all' of bakes with other seeds)");
  parser.option("--dry", options.dry,
                "signal that both recordings play, for 'changes with time'; repeated if shorter");
  parser.flag("--json", options.json, "print JSON, with every octave, band and source");
  QuietOption quiet(parser);
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  if (options.null_rolls != 0 && (options.null_rolls < kMinRolls || options.null_rolls > kMaxRolls))
    return parser.bad_usage(
        err, fmt::format("--null must be 0 or lie between {} and {}", kMinRolls, kMaxRolls));
  if (options.null_rolls != 0 && !options.rolls_folder.empty())
    return parser.bad_usage(err, "give either --null N or --rolls FOLDER");
  const ExitOnSignal stop("compare");
  return parser.end(err, run(options, out, quiet.notes(err)));
}

}  // namespace clamor
