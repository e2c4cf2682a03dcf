#include "formats/bake_file/bake_root_findings.h"

#include <algorithm>
#include <utility>

#include "formats/bake_file/bake_root_values.h"
#include "formats/bake_file/value_limits.h"

namespace clamor {

namespace {

constexpr std::uint8_t kOpeningInFile = 0, kGapInFile = 1;

using bake_root::read_vector;
using bake_root::write_vector;

bool is_size(double size_m) { return size_m >= 0 && size_m < kMaxCoordinateInFile_m; }

}  // namespace

Result<LevelFindings> read_findings(BakeRoot::Reader root) {
  const auto stored = root.getFindings();
  LevelFindings findings;
  findings.closedness = bake_root::text(stored.getClosedness());
  findings.thin_gaps = stored.getThinGaps();
  findings.escaped_share = stored.getEscapedShare();
  if (!(findings.escaped_share >= 0 && findings.escaped_share <= 1))
    return Error("more of the sound leaves the level than there is");
  for (const auto one : stored.getList()) {
    if (one.getKind() > kGapInFile) continue;
    LevelFinding finding;
    finding.kind =
        one.getKind() == kOpeningInFile ? LevelFinding::Kind::kOpening : LevelFinding::Kind::kGap;
    finding.text = bake_root::text(one.getText());
    finding.size_m = one.getSizeM();
    const auto direction = read_vector(one.getDirection(), "a finding");
    if (!direction.ok()) return direction.error();
    finding.direction = *direction;
    if (one.getHasPlace()) {
      const auto place_m = read_vector(one.getPlaceM(), "a finding");
      if (!place_m.ok()) return place_m.error();
      finding.place_m = *place_m;
    }
    if (!is_finite(finding.direction) || !is_finite(finding.place_m.value_or(Vec3(0))) ||
        !is_size(finding.size_m))
      return Error("a finding is out of range");
    findings.list.push_back(std::move(finding));
  }
  if (std::cmp_less(findings.thin_gaps, std::ranges::count(findings.list, LevelFinding::Kind::kGap,
                                                           &LevelFinding::kind)))
    return Error("there are fewer thin gaps than are listed");
  return findings;
}

void write_findings(BakeRoot::Builder root, const LevelFindings& findings) {
  if (findings == LevelFindings()) return;
  auto stored = root.initFindings();
  stored.setClosedness(findings.closedness);
  stored.setThinGaps(findings.thin_gaps);
  stored.setEscapedShare(findings.escaped_share);
  auto list = stored.initList(static_cast<unsigned>(findings.list.size()));
  for (unsigned i = 0; i < list.size(); ++i) {
    const LevelFinding& finding = findings.list[i];
    list[i].setKind(finding.kind == LevelFinding::Kind::kOpening ? kOpeningInFile : kGapInFile);
    list[i].setText(finding.text);
    const bool has_place = finding.place_m && is_finite(*finding.place_m);
    list[i].setHasPlace(has_place);
    if (has_place) write_vector(list[i].initPlaceM(3), *finding.place_m);
    list[i].setSizeM(is_size(finding.size_m) ? finding.size_m : 0);
    write_vector(list[i].initDirection(3),
                 is_finite(finding.direction) ? finding.direction : Vec3(0));
  }
}

}  // namespace clamor
