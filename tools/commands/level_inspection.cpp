#include "tools/commands/level_inspection.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/report/level_report.h"
#include "common/counted_texts.h"
#include "common/printable.h"
#include "common/text.h"
#include "common/utf8_path.h"
#include "formats/gltf/level_import.h"
#include "formats/level/surface_rules.h"
#include "tools/analysis/json_values.h"
#include "tools/program/terminal_output.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

// Calls rule(reason, what it applies to, how much it left out) for each reason.
template <class Rule>
void each_rule(const ImportReport& report, const Rule& rule) {
  for (std::size_t i = 1; i < kNoSurfaceReasons; ++i)
    rule(in_words(static_cast<NoSurface>(i)), surface_rule_in_words(static_cast<NoSurface>(i)),
         report.left_out[i]);
}

void print_rules(const ImportReport& report, std::ostream& out) {
  each_rule(report, [&](std::string_view reason, const std::string& rule, std::size_t count) {
    fmt::print(out, "  rule     {:<26} {:<10} {}\n", reason,
               count == 0 ? "none" : fmt::format("{} left out", count), rule);
  });
}

std::string as_json(const ImportReport& report, const std::vector<std::string>& level,
                    const std::vector<std::string>& warnings) {
  OrderedJson json;
  json["found"] = report.found;
  json["materials"] = OrderedJson::array();
  for (const MaterialAssignment& one : report.materials)
    json["materials"].push_back({{"name", one.material},
                                 {"preset", one.preset},
                                 {"how", one.how},
                                 {"triangles", one.triangles},
                                 {"area_m2", one.area_m2}});
  json["ignored"] = report.ignored;
  json["rules"] = OrderedJson::array();
  each_rule(report, [&](std::string_view reason, const std::string& rule, std::size_t count) {
    json["rules"].push_back({{"reason", reason}, {"applies_to", rule}, {"left_out", count}});
  });
  json["level"] = level;
  json["warnings"] = warnings;
  return json_text(json);
}

}  // namespace

bool is_level_file(const std::string& path) {
  std::array<char, 4> magic{};
  std::ifstream(path_of(path), std::ios::binary).read(magic.data(), magic.size());
  const std::string extension = path_of(path).extension().string();
  return std::string_view(magic.data(), magic.size()) == "glTF" ||
         equal_ignoring_case(extension, ".gltf") || equal_ignoring_case(extension, ".glb");
}

void print_import(const std::string& level, const ImportReport& report, std::ostream& out) {
  fmt::print(out, "{}\n", printable(level));
  for (const auto& line : report.found) fmt::print(out, "  found    {}\n", printable(line));
  for (const auto& material : report.materials)
    fmt::print(out, "  material {:<24} {:<18} {:>8.1f} m2  ({})\n", printable(material.material),
               material.preset.empty() ? "own values" : printable(material.preset),
               material.area_m2, printable(material.how));
  for (const auto& line : report.ignored) fmt::print(out, "  ignored  {}\n", printable(line));
}

Result<void> inspect_level(const std::string& path, const ImportOptions& options, bool json,
                           std::ostream& out) {
  auto imported = import_level(path, options);
  if (!imported.ok()) return imported.error();
  const ImportReport& report = imported->report;
  const LevelReport prepared = prepare_level(imported->level);
  const std::vector<std::string> level = report_lines(prepared);
  std::vector<std::string> warnings = report.warnings;
  for (std::string& warning : report_warnings(prepared)) warnings.push_back(std::move(warning));
  warnings = with_counts(warnings);
  if (json) {
    out << as_json(report, level, warnings) << '\n';
    return {};
  }
  print_import(imported->level.name, report, out);
  print_rules(report, out);
  for (const std::string& line : level) fmt::print(out, "  level    {}\n", printable(line));
  for (const std::string& line : warnings) print_listed_warning(out, line);
  return {};
}

}  // namespace clamor
