#include "tools/report/level_findings.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include <fmt/format.h>

#include "common/counted_texts.h"
#include "tools/program/shell_quote.h"

namespace clamor {

namespace {

// Three numbers from `at` on, separated by commas, and whether `close` follows.
std::optional<Vec3> numbers_at(const char* at, char close) {
  Vec3 place_m;
  for (int axis = 0; axis < 3; ++axis) {
    char* end = nullptr;
    place_m[axis] = std::strtod(at, &end);
    if (end == at) return std::nullopt;
    at = end;
    if (axis == 2) break;
    if (*at++ != ',') return std::nullopt;
    while (*at == ' ') ++at;
  }
  if (close != 0 && *at != close) return std::nullopt;
  return is_finite(place_m) ? std::optional(place_m) : std::nullopt;
}

}  // namespace

std::optional<Vec3> place_in(const std::string& sentence) {
  for (std::size_t i = sentence.find('('); i != std::string::npos; i = sentence.find('(', i + 1))
    if (const auto place_m = numbers_at(sentence.c_str() + i + 1, ')')) return place_m;
  for (std::size_t i = sentence.find("at "); i != std::string::npos;
       i = sentence.find("at ", i + 1))
    if (const auto place_m = numbers_at(sentence.c_str() + i + 3, 0)) return place_m;
  return std::nullopt;
}

std::vector<LevelFinding> findings_of(const BakeStatistics& statistics) {
  using Kind = LevelFinding::Kind;
  std::vector<LevelFinding> all;
  for (const std::string& warning : with_counts(statistics.warnings)) {
    const bool twice = warning.find("are there twice") != std::string::npos;
    all.push_back({twice ? Kind::kDuplicate : Kind::kWarning, warning, place_in(warning), 0, {}});
  }
  const LevelFindings& found = statistics.findings;
  const bool is_open = std::ranges::any_of(
      found.list, [](const LevelFinding& one) { return one.kind == Kind::kOpening; });
  if (!is_open && !found.closedness.empty())
    all.push_back({Kind::kFact, found.closedness, std::nullopt, 0, {}});
  all.insert(all.end(), found.list.begin(), found.list.end());
  return all;
}

const char* title_of(LevelFinding::Kind kind) {
  switch (kind) {
    case LevelFinding::Kind::kWarning:
      return "Warning";
    case LevelFinding::Kind::kFact:
      return "Fine";
    case LevelFinding::Kind::kOpening:
      return "Opening";
    case LevelFinding::Kind::kGap:
      return "Thin gap";
    case LevelFinding::Kind::kDuplicate:
      break;
  }
  return "Twice there";
}

bool is_warning(const LevelFinding& finding) {
  return finding.kind == LevelFinding::Kind::kWarning ||
         finding.kind == LevelFinding::Kind::kDuplicate;
}

std::string view_command(const std::string& path, const Vec3& place_m) {
  return fmt::format("clamor view {} --at {:.1f},{:.1f},{:.1f}", shell_quoted(path),
                     place_m.x + 0.0, place_m.y + 0.0, place_m.z + 0.0);
}

}  // namespace clamor
