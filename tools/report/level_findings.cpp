#include "tools/report/level_findings.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include <fmt/format.h>

#include "formats/bake_file/bake_metadata.h"
#include "formats/level/level.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxGaps = 200;
// The geometry of a file is in millimetres, so that edges that rest on a surface may seem to be a
// little off it.
constexpr double kLeastGap_m = 0.002;
constexpr std::size_t kMaxEmittersJudged = 500;

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

Level level_of(const Room& room) {
  Level level;
  level.mesh = room.mesh;
  level.materials = room.file->materials();
  level.emitters = room.emitters();
  // Of a crowd, a few show where its sound escapes.
  if (level.emitters.size() > kMaxEmittersJudged) {
    std::vector<Emitter> few;
    for (std::size_t i = 0; i < kMaxEmittersJudged; ++i)
      few.push_back(level.emitters[i * level.emitters.size() / kMaxEmittersJudged]);
    level.emitters = std::move(few);
  }
  return level;
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

LevelFindings find_in_level(const Room& room) {
  using Kind = LevelFinding::Kind;
  LevelFindings found;
  for (const std::string& warning : room.file->statistics().warnings) {
    const bool twice = warning.find("are there twice") != std::string::npos;
    found.findings.push_back(
        {twice ? Kind::kDuplicate : Kind::kWarning, warning, place_in(warning), 0, {}});
  }
  if (room.mesh.triangles.empty()) return found;
  Level level = level_of(room);
  found.level = prepare_level(level);
  std::erase_if(found.level.gaps, [](const ThinGap& gap) { return gap.width_m < kLeastGap_m; });
  for (const LevelOpening& opening : found.level.openings.openings)
    found.findings.push_back(
        {Kind::kOpening,
         fmt::format("{:.1f} % of the sound leaves {}", 100 * opening.share, in_words(opening)),
         opening.width_m > 0 ? std::optional(opening.place_m) : std::nullopt, opening.width_m,
         opening.direction});
  for (std::size_t i = 0; i < std::min(found.level.gaps.size(), kMaxGaps); ++i) {
    const ThinGap& gap = found.level.gaps[i];
    found.findings.push_back(
        {Kind::kGap, "edges nearly meet: " + in_words(gap), gap.place_m, gap.length_m, {}});
  }
  if (found.level.openings.rays > 0 && found.level.openings.openings.empty())
    found.findings.push_back(
        {Kind::kFact,
         fmt::format("closed: none of {} rays left it", grouped(found.level.openings.rays)),
         std::nullopt,
         0,
         {}});
  return found;
}

}  // namespace clamor
