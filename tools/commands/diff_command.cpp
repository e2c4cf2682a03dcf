// diff_command.cpp: clamor diff: prints how two bake files differ.
#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "formats/bake_file/bake_file.h"
#include "tools/analysis/json_values.h"
#include "tools/commands/bake_difference.h"
#include "tools/commands/bake_verdict.h"
#include "tools/commands/commands.h"
#include "tools/program/arguments.h"
#include "tools/program/quiet_option.h"
#include "tools/program/stage_notice.h"
#include "tools/program/terminal_output.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

using Levels = std::array<double, kBandCount>;

struct Comparison {
  bool same = false;    // sounds the same, to the last bit
  BakeVerdict verdict;  // if it does not
  std::vector<BakeDifference> differences;
  Levels a_db{}, b_db{}, louder{};
};

Result<Comparison> compared(const BakeFile& a, const BakeFile& b) {
  Comparison comparison;
  const auto same = sound_identical(a, b);
  if (!same.ok()) return same.error();
  comparison.same = *same;
  comparison.verdict =
      *same ? BakeVerdict{Audible::kNo, "They sound the same, to the last bit."} : verdict_on(a, b);
  comparison.differences = differences_of(a, b);
  const Bands none{};
  const Bands& in_a = a.top() != nullptr ? a.top()->power : none;
  const Bands& in_b = b.top() != nullptr ? b.top()->power : none;
  for (std::size_t band = 0; band < kBandCount; ++band) {
    comparison.a_db[band] = decibels_of(in_a[band]);
    comparison.b_db[band] = decibels_of(in_b[band]);
  }
  comparison.louder = level_difference_db(in_a, in_b);
  return comparison;
}

void print_json(const Comparison& comparison, std::ostream& out) {
  OrderedJson rows = OrderedJson::array();
  for (const auto& [what, in_a, in_b] : comparison.differences)
    rows.push_back({{"what", what}, {"a", in_a}, {"b", in_b}});
  const OrderedJson whole = {{"same", comparison.same},
                             {"audible", comparison.verdict.audible == Audible::kNo      ? "no"
                                         : comparison.verdict.audible == Audible::kMaybe ? "maybe"
                                                                                         : "yes"},
                             {"verdict", comparison.verdict.sentence},
                             {"differences", rows},
                             {"level_db", comparison.louder}};
  out << json_text(whole) << '\n';
}

void print_rows(const std::vector<BakeDifference>& differences, std::ostream& out) {
  constexpr std::size_t kMaxRows = 60, kColumn = 24;
  const auto shown = [](const std::string& text) { return text.empty() ? "-" : printable(text); };
  for (std::size_t i = 0; i < std::min(kMaxRows, differences.size()); ++i) {
    const auto& [what, in_a, in_b] = differences[i];
    if (what.size() <= kColumn && in_a.size() <= kColumn)
      fmt::print(out, "  {:<24}  {:<24}  {}\n", shown(what), shown(in_a), shown(in_b));
    else
      fmt::print(out, "  {}\n    A  {}\n    B  {}\n", shown(what), shown(in_a), shown(in_b));
  }
  if (differences.size() > kMaxRows)
    fmt::print(out, "  and {} more (--json has all)\n", differences.size() - kMaxRows);
}

void print_levels(const Comparison& comparison, std::ostream& out) {
  const auto row = [&out](const char* title, const auto& cells) {
    fmt::print(out, "  {:<24}", title);
    for (const std::string& cell : cells) fmt::print(out, "{:>8}", cell);
    fmt::print(out, "\n");
  };
  const auto cells = [](const Levels& levels, const char* format) {
    std::array<std::string, kBandCount> texts;
    for (std::size_t b = 0; b < kBandCount; ++b)
      texts[b] = levels[b] > -300 ? fmt::format(fmt::runtime(format), levels[b]) : "-";
    return texts;
  };
  std::array<std::string, kBandCount> bands;
  for (std::size_t b = 0; b < kBandCount; ++b)
    bands[b] = kBandCentres_hz[b] < 1000 ? fmt::format("{:.0f} Hz", kBandCentres_hz[b])
                                         : fmt::format("{:.0f} kHz", kBandCentres_hz[b] / 1000);
  row("power of all sources", bands);
  row("A, dB", cells(comparison.a_db, "{:.2f}"));
  row("B, dB", cells(comparison.b_db, "{:.2f}"));
  row("B - A, dB", cells(comparison.louder, "{:+.2f}"));
}

}  // namespace

int run_diff(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string path_a, path_b;
  bool json = false;
  Arguments parser(
      "diff",
      "Prints how two bake files differ: provenance, settings, emitters, materials, "
      "sources, and the level of B relative to A per band; and whether that can be "
      "heard, or is what another seed changes. Exit code 0 when they "
      "sound the same, to the last bit; 1 when they differ; 3 when one cannot be read.",
      "clamor diff before.clamor after.clamor");
  parser.positional("a", path_a, "a bake file");
  parser.positional("b", path_b, "the bake file to compare with it");
  parser.flag("--json", json,
              "print JSON: same, audible (no, maybe, yes), verdict, differences (what, a, b), and "
              "level_db per band");
  QuietOption quiet(parser);
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto fail = [&err](const Error& error) {
    print_error(err, "diff", error.message);
    return kDiffBadInput;
  };
  const auto a = BakeFile::open(path_a, FileAccess::kMap),
             b = BakeFile::open(path_b, FileAccess::kMap);
  if (!a.ok()) return fail(a.error());
  if (!b.ok()) return fail(b.error());
  StageNotice notice(quiet.notes(err));
  notice.begin("comparing the sources");
  const auto comparison = compared(*a, *b);
  notice.end();
  if (!comparison.ok()) return fail(comparison.error());
  const int code = comparison->same ? kSuccess : kDiffers;
  if (json) {
    print_json(*comparison, out);
    return code;
  }
  fmt::print(out, "A {}\nB {}\n", printable(path_a), printable(path_b));
  fmt::print(out, "{}\n", comparison->verdict.sentence);
  if (comparison->differences.empty())
    fmt::print(out, "  no difference in provenance, settings, emitters, materials and sizes\n");
  print_rows(comparison->differences, out);
  if (!comparison->same) print_levels(*comparison, out);
  return code;
}

}  // namespace clamor
