#include "tools/commands/compare_table.h"

#include <cmath>
#include <optional>
#include <ostream>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace clamor {

namespace {

// Formats a value with its unit, if it has one.
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

}  // namespace

std::string compare_help() {
  std::string text =
      "Prints which differences between a recording B and the reference A are audible: one row per "
      "measure, where it differs most (octave, ERB band, moment, ear), against the just-noticeable "
      "difference (JND). One or two channels; other sample rates are resampled to 48 kHz; the "
      "shorter recording is padded with silence. Exit code 0 when they could be compared, whatever "
      "the result.\n\n"
      "Measures, in programmes (p) and impulse responses (r):\n";
  for (const MeasureInfo& info : kMeasures) {
    const char* const kind = !info.only_in                           ? "p r"
                             : info.only_in == SoundKind::kProgramme ? "p  "
                                                                     : "  r";
    text += fmt::format("  {:<19} {}  {}", info.key, kind, info.source);
    text += info.jnd ? fmt::format("; JND {} ({})\n", jnd_text(info, *info.jnd), info.jnd_source)
                     : fmt::format("; JND {}\n", info.jnd_source);
  }
  return text +
         "\nA crowd or late reverberation is a random texture: two exact renderings differ by "
         "chance, and a difference below the 95th percentile of chance passes. The best yardstick "
         "is a folder of exact renderings with other phases, --rolls. Without one, --null N draws "
         "N pairs of stationary noise with the power of A per frequency, moment and ear: right for "
         "rain or surf, too strict for a crowd of a few looped sounds, whose interference does not "
         "average out.\n"
         "\nA room in which nothing moves is a fixed filter. With --dry SIGNAL, the signal that "
         "both recordings play, 'changes with time' is the part of each recording that the best "
         "fixed filter of 1.25 s cannot produce from that signal, in dB relative to the whole "
         "(-60: none). An exact rendering is below -50 dB; above -25 dB, the room audibly follows "
         "the music. It takes about as long as both recordings.\n";
}

std::string verdict_on(const Difference& difference, const NullDistribution* null) {
  if (difference.worst() == nullptr) return "";
  const double size_95 = null == nullptr ? 0 : null->size_95(difference.info->measure);
  if (difference.info->by_chance && null != nullptr)
    return difference.beyond_chance(size_95) ? "beyond chance" : "ok";
  if (!difference.info->jnd) return "";
  return difference.audible(size_95) ? "audible" : "ok";
}

double chance_95(const NullDistribution& null, const Difference& difference, double jnd) {
  return null.size_95(difference.info->measure) * (jnd > 0 ? jnd : 1);
}

void print_comparison(const std::string& a, const std::string& b,
                      const std::vector<Difference>& differences, const NullDistribution* null,
                      std::ostream& out) {
  out << fmt::format("{:<18}{:>13}{:>13}{:>14}   {:<16}{:>9}", "", "A", "B", "B - A", "at", "JND");
  if (null != nullptr) out << fmt::format("{:>12}", "chance 95%");
  out << '\n';
  std::vector<std::string> audible, beyond_chance;
  for (const Difference& difference : differences) {
    const MeasureInfo& info = *difference.info;
    if (info.by_chance && null == nullptr) continue;  // meaningless without a null distribution
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
      if (null != nullptr) {
        const double chance = chance_95(*null, difference, point->jnd);
        row += fmt::format("{:>12}", std::isnan(chance) ? "-" : with(chance, "", digits));
      }
      const std::string heard = verdict_on(difference, null);
      if (heard == "audible") audible.emplace_back(info.title);
      if (heard == "beyond chance") beyond_chance.emplace_back(info.title);
      if (!heard.empty()) row += "  " + heard;
    }
    row.erase(row.find_last_not_of(' ') + 1);
    out << row << '\n';
  }
  if (audible.empty() && beyond_chance.empty())
    out << fmt::format("no measure tells {} from {}\n", b, a);
  if (!audible.empty()) out << fmt::format("audible: {}\n", fmt::join(audible, "; "));
  if (!beyond_chance.empty())
    out << fmt::format("beyond chance: {}\n", fmt::join(beyond_chance, "; "));
}

}  // namespace clamor
