#include "tools/report/report_document.h"

#include <cmath>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "common/printable.h"
#include "embedded_page.h"
#include "tools/analysis/report_page.h"
#include "tools/program/text_format.h"
#include "tools/report/report_answer.h"
#include "tools/report/report_doors.h"
#include "tools/report/report_file.h"
#include "tools/report/report_listeners.h"
#include "tools/report/report_materials.h"
#include "tools/report/report_parameters.h"
#include "tools/report/report_words.h"
#include "tools/report/room_summary.h"

namespace clamor {

namespace {

std::string setting(const ReportContents& contents) {
  const BakeFile& file = contents.measured.file();
  const BakeOverview& overview = contents.overview;
  return fmt::format("{}: {} and {}, made by {}", file_name(file),
                     counted(overview.emitter_count, "emitter"),
                     counted(overview.secondary, "secondary source"), file.provenance().tool);
}

// Replaces what printable() replaces, escapes included, because the page shows the strings. "<" is
// escaped, since "</script>" in a name would end the script.
std::string json_for_html(const std::string& json) {
  std::string text;
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (json[i] == '<') {
      text += "\\u003c";
    } else if (json[i] != '\\' || i + 1 == json.size()) {
      text += json[i];
    } else if (const char kind = json[++i]; std::string_view("bfnrtu").find(kind) < 6) {
      text += '?';
      if (kind == 'u') i += 4;
    } else {
      text += {'\\', kind};
    }
  }
  return printable(text);
}

void write_floor(const ReportContents& contents, ReportPage& page) {
  const FloorMap& map = contents.map;
  if (map.cells.empty()) return;
  page.heading("Over the floor");
  page.markup("<div id=\"floor\"></div>\n");
  std::string text = fmt::format(
      "{} at ear height, {:.2g} m apart; each value from {} chosen for the place, heard in "
      "straight lines.",
      counted(map.cells.size(), "place"), map.step_m, counted(map.sources, "source"));
  if (contents.map_at_first) {
    text += " At listener 1 that differs from the full measurement by ";
    bool is_first = true;
    for (const char* name : {"T30", "C80", "G"}) {
      const ParameterKind& kind = kind_of(name);
      double squares = 0;
      int count = 0;
      for (std::size_t b = 1; b < 7; ++b) {
        const auto& full = (contents.measured.responses[0].parameters.*kind.value)[b];
        const auto& quick = (*contents.map_at_first.*kind.value)[b];
        if (!full || !quick || !(kind.noticeable_at(*full) > 0)) continue;
        squares += std::pow((*quick - *full) / kind.noticeable_at(*full), 2);
        ++count;
      }
      if (count == 0) continue;
      text += fmt::format("{}{:.1f} ({})", is_first ? "" : ", ", std::sqrt(squares / count), name);
      is_first = false;
    }
    text += " just-noticeable differences (root mean square of 125 Hz to 4 kHz).";
  }
  page.markup("<p class=\"note\">" + escaped(text) + "</p>\n");
}

}  // namespace

std::string report_html(const ReportContents& contents) {
  ReportPage page("report", "How " + contents.measured.file().provenance().level + " sounds",
                  setting(contents));
  const std::vector<MetMaterial> materials = met_materials(contents.measured.file());
  write_answer(contents, page);
  write_findings(contents, materials, page);
  page.markup(kViewMarkup);
  write_parameters(contents, page);
  write_listeners(contents, page);
  write_floor(contents, page);
  write_doors(contents.measured.file(), page);
  write_materials(contents.measured.file(), materials, page);
  write_file(contents, page);
  page.markup("<script type=\"application/json\" id=\"level\">" +
              json_for_html(contents.view.json) + "</script>\n<script>\n" + kViewScript +
              "</script>\n");
  return page.html();
}

}  // namespace clamor
