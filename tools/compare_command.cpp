// compare_command.cpp: clamor compare: what the ear could tell two recordings apart by.
#include <algorithm>
#include <cmath>
#include <mutex>
#include <ostream>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "formats/audio_file.h"
#include "formats/level.h"
#include "runtime/null_distribution.h"
#include "runtime/random_texture.h"
#include "runtime/sound_comparison.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/progress.h"

namespace clamor {

namespace {

using nlohmann::ordered_json;

constexpr int kMostRolls = 10000;
constexpr std::size_t kMostPointsInJson = 64;  // moments of a long programme are not listed

struct Options {
  std::string a, b, kind = "auto";
  int null_rolls = 0;
  std::uint64_t seed = 1;
  bool json = false;
};

// "%" and "LU" stand behind a value, nothing does where the unit is a pure number.
std::string with(double value, const char* unit, int digits, bool sign = false) {
  std::string text =
      sign ? fmt::format("{:+.{}f}", value, digits) : fmt::format("{:.{}f}", value, digits);
  if (*unit != '\0') text += std::string(" ") + unit;
  return text;
}

std::string jnd_text(const MeasureInfo& info, double jnd) {
  if (!info.jnd) return "-";
  if (*info.jnd == 0) return "any";
  return fmt::format("{:.3g}", jnd) + (*info.unit != '\0' ? std::string(" ") + info.unit : "");
}

// All measures with their sources, for --help.
std::string purpose() {
  std::string text =
      "Tells by what the ear could tell two recordings apart, B from A: a row per measure with "
      "the\n"
      "place where they differ most (octave, ERB band, moment, ear), against the just-noticeable\n"
      "difference (JND). One or two channels; other rates are resampled to 48 kHz; the shorter\n"
      "counts as silent from its end on. Exit code 0 when they could be compared, alike or not.\n\n"
      "Measures, in programmes (p) and impulse responses (r):\n";
  for (const MeasureInfo& info : kMeasures) {
    const char* const kind = !info.only_in                           ? "p r"
                             : info.only_in == SoundKind::kProgramme ? "p  "
                                                                     : "  r";
    text += fmt::format("  {:<19} {}  {}", info.key, kind, info.source);
    text += info.jnd ? fmt::format("; JND {} ({})\n", jnd_text(info, *info.jnd), info.jnd_source)
                     : "; no JND\n";
  }
  return text +
         "\nA crowd or a late tail is a random texture: two exact renderings differ by chance. "
         "--null "
         "N\ndraws N pairs of other textures with the power of A, per frequency, moment and ear, "
         "and "
         "lets\npass what lies inside the 95th percentile of their differences.\n";
}

Error in_file(const std::string& path, const std::string& sentence) {
  return Error(sentence).in(path);
}

Result<void> check_alike(const Options& options, const Sound& a, const Sound& b) {
  const auto kind = [](const Sound& sound) {
    return sound.channels.size() == 1 ? "mono" : "stereo";
  };
  if (a.channels.size() != b.channels.size())
    return in_file(options.b, fmt::format("is {}, but {} is {}; give two of the same number of "
                                          "channels.",
                                          kind(b), in_quotes(options.a), kind(a)));
  return {};
}

std::string place_of(const MeasureInfo& info, const DifferencePoint& point) {
  std::string place;
  if (info.jnd && *point.difference == 0) return "";
  if (std::string_view(info.place) == "Hz")
    place = point.at >= 1000 ? fmt::format("{:.3g} kHz", point.at / 1000)
                             : fmt::format("{:.0f} Hz", point.at);
  else if (std::string_view(info.place) == "s")
    place = fmt::format("{:.1f} s", point.at);
  if (point.channel)
    place += (place.empty() ? "" : ", ") + std::string(*point.channel == 0 ? "left" : "right");
  return place;
}

// A verdict per measure: heard or not, where it can be said.
const char* verdict(const Difference& difference, const NullDistribution* null) {
  if (!difference.info->jnd || difference.worst() == nullptr) return "";
  const double size_95 = null == nullptr ? 0 : null->size_95(difference.info->measure);
  return difference.audible(size_95) ? "audible" : "ok";
}

// The 95th percentile of chance, in the unit of the difference at a point.
double null_95(const NullDistribution& null, const Difference& difference, double jnd) {
  return null.size_95(difference.info->measure) * (jnd > 0 ? jnd : 1);
}

void print_table(const Options& options, const std::vector<Difference>& differences,
                 const NullDistribution* null, std::ostream& out) {
  out << fmt::format("{:<18}{:>13}{:>13}{:>14}   {:<16}{:>9}", "", "A", "B", "B - A", "at", "JND");
  if (null != nullptr) out << fmt::format("{:>12}", "chance 95%");
  out << '\n';
  std::vector<std::string> audible;
  for (const Difference& difference : differences) {
    const MeasureInfo& info = *difference.info;
    const DifferencePoint* const point = difference.worst();
    std::string row = fmt::format("{:<18}", info.title);
    if (point == nullptr) {
      row += fmt::format("{:>13}{:>13}{:>14}", "-", "-", "-");
    } else {
      const auto value = [&](const std::optional<double>& x) {
        return x ? with(*x, info.value_unit, info.digits) : "";
      };
      const int digits = std::string_view(info.unit) == "%" ? 1 : info.digits;
      row += fmt::format("{:>13}{:>13}{:>14}   {:<16}{:>9}", value(point->a), value(point->b),
                         with(*point->difference, info.unit, digits, info.jnd.has_value()),
                         place_of(info, *point), jnd_text(info, point->jnd));
      if (null != nullptr)
        row += fmt::format("{:>12}", with(null_95(*null, difference, point->jnd), "", digits));
      const std::string heard = verdict(difference, null);
      if (heard == "audible") audible.emplace_back(info.title);
      if (!heard.empty()) row += "  " + heard;
    }
    row.erase(row.find_last_not_of(' ') + 1);
    out << row << '\n';
  }
  if (audible.empty()) {
    out << fmt::format("no measure tells {} from {}\n", options.b, options.a);
    return;
  }
  out << "audible: " << fmt::format("{}", fmt::join(audible, "; ")) << '\n';
}

ordered_json number(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json to_json(const DifferencePoint& point, const MeasureInfo& info) {
  ordered_json json;
  if (std::string_view(info.place) == "Hz") json["hz"] = point.at;
  if (std::string_view(info.place) == "s") json["s"] = point.at;
  if (point.channel) json["channel"] = *point.channel;
  json["a"] = number(point.a);
  json["b"] = number(point.b);
  json["difference"] = number(point.difference);
  json["jnd"] = info.jnd ? ordered_json(point.jnd) : ordered_json(nullptr);
  json["judged"] = point.judged;
  return json;
}

ordered_json to_json(const Difference& difference, const NullDistribution* null) {
  const MeasureInfo& info = *difference.info;
  const DifferencePoint* const worst = difference.worst();
  ordered_json json = to_json(worst == nullptr ? DifferencePoint{} : *worst, info);
  json.erase("judged");
  if (worst == nullptr) json["jnd"] = number(info.jnd);
  if (null != nullptr)
    json["null_95"] = worst == nullptr ? ordered_json(nullptr)
                                       : ordered_json(null_95(*null, difference, worst->jnd));
  const std::string heard = verdict(difference, null);
  json["verdict"] = heard.empty() ? ordered_json(nullptr) : ordered_json(heard);
  json["value_unit"] = info.value_unit;
  json["unit"] = info.unit;
  json["source"] = info.source;
  json["jnd_source"] = info.jnd_source;
  if (difference.points.size() > 1 && difference.points.size() <= kMostPointsInJson)
    for (const DifferencePoint& point : difference.points)
      json["points"].push_back(to_json(point, info));
  return json;
}

ordered_json to_json(const std::string& path, const Sound& sound) {
  return {{"file", path},
          {"seconds", static_cast<double>(sound.frames()) / kSampleRate_hz},
          {"channels", sound.channels.size()},
          {"rate_hz", sound.file_rate_hz}};
}

NullDistribution null_of(const Options& options, const SoundAnalysis& a, std::ostream& err) {
  const RandomTexture texture(a.sound);
  Progress progress(err, "  chance");
  std::mutex printing;
  int done = 0;
  return null_distribution(options.null_rolls, [&](std::uint32_t roll) {
    const auto one = [&](std::uint32_t i) {
      return analyse(texture.roll(options.seed, 2 * roll + i), a.kind);
    };
    std::vector<Difference> differences = compare(one(0), one(1));
    const std::scoped_lock lock(printing);
    progress.update(static_cast<double>(++done) / options.null_rolls,
                    fmt::format("{} of {}", done, options.null_rolls));
    return differences;
  });
}

Result<void> run(const Options& options, std::ostream& out, std::ostream& err) {
  constexpr int kChannels = 2;
  Result<Sound> a = read_channels(options.a, kChannels);
  if (!a) return a.error();
  Result<Sound> b = read_channels(options.b, kChannels);
  if (!b) return b.error();
  if (const auto alike = check_alike(options, *a, *b); !alike) return alike;

  const bool response =
      options.kind == "response" || (options.kind == "auto" && looks_like_impulse_response(*a) &&
                                     looks_like_impulse_response(*b));
  const SoundKind kind = response ? SoundKind::kImpulseResponse : SoundKind::kProgramme;
  ordered_json json;
  json["a"] = to_json(options.a, *a);
  json["b"] = to_json(options.b, *b);
  json["kind"] = response ? "response" : "programme";

  const auto seconds = [](std::size_t frames) {
    return static_cast<double>(frames) / kSampleRate_hz;
  };
  const std::size_t frames = std::max(a->frames(), b->frames());
  if (a->frames() != b->frames())
    err << fmt::format(
        "clamor compare: A has {:.3f} s and B {:.3f} s; the shorter counts as silent "
        "from its end on.\n",
        seconds(a->frames()), seconds(b->frames()));
  for (Sound* const sound : {&*a, &*b})
    for (auto& channel : sound->channels) channel.resize(frames);

  const SoundAnalysis analysis_a = analyse(std::move(*a), kind);
  const SoundAnalysis analysis_b = analyse(std::move(*b), kind);
  const std::vector<Difference> differences = compare(analysis_a, analysis_b);
  std::optional<NullDistribution> null;
  if (options.null_rolls > 0) null = null_of(options, analysis_a, err);
  const NullDistribution* const yardstick = null ? &*null : nullptr;

  if (!options.json) {
    out << fmt::format("A {}\nB {}\n{:.2f} s, {}, compared as {}\n\n", options.a, options.b,
                       seconds(frames), analysis_a.ears.size() == 1 ? "mono" : "stereo",
                       response ? "impulse responses" : "programmes");
    print_table(options, differences, yardstick, out);
    return {};
  }
  if (yardstick != nullptr) json["null"] = {{"rolls", options.null_rolls}, {"seed", options.seed}};
  json["audible"] = ordered_json::array();
  for (const Difference& difference : differences) {
    if (std::string_view(verdict(difference, yardstick)) == "audible")
      json["audible"].push_back(difference.info->key);
    json["measures"][difference.info->key] = to_json(difference, yardstick);
  }
  out << json.dump(2, ' ', false, ordered_json::error_handler_t::replace) << '\n';
  return {};
}

}  // namespace

int run_compare(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  Options options;
  Arguments parser("compare", purpose(), "clamor compare exact.wav approximation.wav --null 100");
  parser.positional("A", options.a, "the reference: WAV, FLAC, Ogg or MP3");
  parser.positional("B", options.b, "what is compared with it");
  parser.option("--as", options.kind,
                "programme or response; auto: responses where both begin at once and decay");
  parser.option("--null", options.null_rolls,
                "for textures: rolls of chance, 19 to 10000, 100 for a firm yardstick; 0: none");
  parser.option("--seed", options.seed, "of the rolls");
  parser.flag("--json", options.json, "all of it as JSON, with every octave, band and source");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  if (options.kind != "auto" && options.kind != "programme" && options.kind != "response")
    return parser.bad_usage(err,
                            "--as is auto, programme or response, not " + in_quotes(options.kind));
  if (options.null_rolls != 0 &&
      (options.null_rolls < kFewestRolls || options.null_rolls > kMostRolls))
    return parser.bad_usage(
        err, fmt::format("--null must be 0 or lie between {} and {}", kFewestRolls, kMostRolls));
  if (const Result<void> done = run(options, out, err); !done) {
    err << "clamor compare: " << done.error().message << '\n';
    return kBadInput;
  }
  return kSuccess;
}

}  // namespace clamor
