#include "tools/report/report_answer.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "bake/report/lost_power.h"
#include "tools/program/text_format.h"
#include "tools/report/report_words.h"

namespace clamor {

namespace {

const char* meaning_of(const std::string& name) {
  if (name == "T30") return "reverberation time";
  if (name == "EDT") return "early decay time";
  if (name == "C80") return "clarity of music";
  if (name == "D50") return "definition of speech";
  return "strength, the level";
}

std::size_t problems(const ReportContents& contents) {
  return static_cast<std::size_t>(std::ranges::count_if(contents.findings, is_warning));
}

// "In wood.clamor T30 is 1.14 s (+1.3), EDT is 1.02 s (+0.4); in brackets the difference ..."
std::string comparison(const ReportContents& contents) {
  std::string text = "In " + file_name(contents.other->file());
  bool is_first = true;
  for (const char* name : {"T30", "EDT", "C80", "D50", "G"}) {
    const ParameterKind& kind = kind_of(name);
    const auto here = middle_value(contents.measured.responses, kind),
               there = middle_value(contents.other->responses, kind);
    if (!here || !there || !(kind.noticeable_at(*here) > 0)) continue;
    const double steps = (*there - *here) / kind.noticeable_at(*here);
    text += fmt::format("{} {} is {}{} ({:+.1f})", is_first ? "" : ",", name,
                        value_text(there, kind.is_share ? 2 : kind.digits - 1),
                        kind.unit[0] != 0 ? " " + std::string(kind.unit) : "", steps);
    is_first = false;
  }
  return text + "; in brackets the difference from this bake in just-noticeable differences.";
}

}  // namespace

void write_answer(const ReportContents& contents, ReportPage& page) {
  const auto& responses = contents.measured.responses;
  const bool is_crowd = !contents.measured.meter->excitation().emitter;
  const Enclosure enclosure = enclosure_of(contents.measured.file().statistics().findings);
  std::string text = described(responses, enclosure, is_crowd);
  const LostPower lost =
      lost_power(contents.measured.file().statistics(), contents.measured.file().materials());
  const std::size_t wrong = problems(contents);
  text += wrong == 0 && enclosure == Enclosure::kMostlyOpen
              ? fmt::format(" {:.0f} % of the power left it. The bake warns of nothing else.",
                            100 * lost.all())
          : wrong == 0 ? " The bake found nothing wrong with the level."
                       : fmt::format(" The bake warns of {}.",
                                     wrong == 1 ? "one thing" : fmt::format("{} things", wrong));
  page.markup("<p class=\"headline\">" + escaped(text) + "</p>\n");
  std::string facts = "<ul class=\"facts\">";
  const auto fact = [&](const std::string& value, const std::string& words) {
    facts += fmt::format("<li><b>{}</b><span>{}</span></li>", escaped(value), escaped(words));
  };
  for (const char* name : {"T30", "EDT", "C80", "D50", "G"}) {
    if (is_crowd && name != std::string("T30") && name != std::string("G")) continue;
    const ParameterKind& kind = kind_of(name);
    const auto value = middle_value(responses, kind);
    if (!value) continue;
    std::string words = fmt::format("{}, {}", name, meaning_of(name));
    if (contents.other)
      if (const auto other = middle_value(contents.other->responses, kind))
        words += fmt::format("; {} in {}", value_text(other, kind.is_share ? 2 : kind.digits - 1),
                             file_name(contents.other->file()));
    fact(value_text(value, kind.is_share ? 2 : kind.digits - 1) +
             (kind.unit[0] != 0 ? " " + std::string(kind.unit) : ""),
         words);
  }
  if (const auto ratio = bass_ratio(responses))
    fact(fmt::format("{:.2f}", *ratio), "bass ratio: T30 below 350 Hz over that above");
  const std::string ways = ways_of(lost);
  fact(fmt::format("{:.1f} %", 100 * lost.all()),
       "of the power left the level" + (ways.empty() ? "" : ", " + ways));
  page.markup(facts + "</ul>\n");
  page.markup(fmt::format(
      "<p class=\"note\">Means over {} and the octaves of 500 Hz and 1 kHz, for an "
      "impulse from {}.</p>\n",
      counted(responses.size(), "listener"), escaped(contents.measured.meter->excitation().words)));
}

void write_findings(const ReportContents& contents, std::span<const MetMaterial> materials,
                    ReportPage& page) {
  using Kind = LevelFinding::Kind;
  constexpr std::size_t kShownGaps = 5;
  std::string list = "<ul class=\"findings\" aria-label=\"Findings\">";
  std::size_t gaps = 0, number = 0;
  if (const std::string why = cause_of_decay(contents.measured.responses, materials); !why.empty())
    list += "<li><span class=\"kind\">What rings</span><span>" + escaped(why) +
            "</span><span></span></li>";
  for (const LevelFinding& finding : contents.findings) {
    const std::size_t index = number++;
    if (finding.kind == Kind::kGap && ++gaps > kShownGaps) continue;
    list += fmt::format("<li{}><span class=\"kind\">{}</span><span>{}</span>",
                        is_warning(finding)           ? " class=\"wrong\""
                        : finding.kind == Kind::kFact ? " class=\"fine\""
                                                      : "",
                        title_of(finding.kind), escaped(finding.text));
    list += finding.place_m ? fmt::format(
                                  "<button type=\"button\" data-finding=\"{}\" aria-label=\"Show "
                                  "in the view: {}\">Show in the view</button>",
                                  index, escaped(finding.text))
                            : "<span></span>";
    list += "</li>\n";
  }
  if (const LevelFindings& found = contents.measured.file().statistics().findings;
      gaps > kShownGaps)
    list += fmt::format(
        "<li><span class=\"kind\">Thin gap</span><span>and {} more; {} {} in the "
        "view</span><span></span></li>\n",
        found.thin_gaps - kShownGaps, gaps, gaps < found.thin_gaps ? "of them are" : "are");
  if (contents.other)
    list += "<li><span class=\"kind\">Compared</span><span>" + escaped(comparison(contents)) +
            "</span><span></span></li>\n";
  page.markup(list + "</ul>\n");
}

}  // namespace clamor
