#include "tools/report/report_doors.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/bounds.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/level/movable_part.h"
#include "tools/program/text_format.h"
#include "tools/report/bake_overview.h"
#include "tools/report/report_words.h"

namespace clamor {

namespace {

constexpr std::size_t kSpeechBand = 4;  // 1 kHz

std::vector<std::string> materials_of(const BakeFile& file, const MovablePart& part) {
  std::vector<std::string> names;
  for (const std::uint16_t material :
       std::set<std::uint16_t>(part.mesh.materials.begin(), part.mesh.materials.end())) {
    const Material& made_of = file.materials()[material];
    const auto share = static_cast<double>(made_of.transmission[kSpeechBand]);
    names.push_back(share > 0 ? fmt::format("{} (lets {:.0f} dB through at 1 kHz)", made_of.name,
                                            10 * std::log10(share))
                              : made_of.name + " (lets nothing through)");
  }
  return names;
}

std::string size_text(const std::vector<double>& sides_m) {
  return fmt::format("{:.2f}", fmt::join(sides_m, " x "));
}

}  // namespace

PartBox box_of(const MovablePart& part) {
  const Boundsf own = bounds_of(part.mesh);
  const Matrix axes = part.rest_pose.scale * glm::mat3_cast(Quaternion(part.rest_pose.rotation));
  PartBox box;
  box.centre_m = part.rest_pose.position_m + axes * Vec3(0.5f * (own.low_m + own.high_m));
  for (int axis = 0; axis < 3; ++axis)
    box.half_m[static_cast<std::size_t>(axis)] =
        axes[axis] * static_cast<double>(0.5f * (own.high_m[axis] - own.low_m[axis]));
  return box;
}

void write_doors(const BakeFile& file, ReportPage& page) {
  const auto& portals = file.portals().portals;
  const auto& parts = file.movable_parts();
  if (portals.empty() && parts.empty()) return;
  page.heading("Doors and portals");
  page.paragraph(fmt::format(
      "The level has {} and {}. All figures of this page are for parts at rest and open portals; "
      "clamor view opens and closes them.",
      counted(parts.size(), "movable part"), counted(portals.size(), "portal")));
  ReportTable table{"doors",
                    "Movable parts and portals: the place of their middle, and their size",
                    {"name", "kind", "place (m)", "size (m)", "what it is"},
                    {}};
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const MovablePart& part = parts[p];
    std::vector<std::string> what = materials_of(file, part);
    for (const Portal& portal : portals)
      if (std::ranges::find(portal.parts, p) != portal.parts.end())
        what.push_back("opens and closes " + in_quotes(portal.name));
    const PartBox box = box_of(part);
    std::vector<double> sides_m;
    for (const Vec3& half_m : box.half_m) sides_m.push_back(2 * length(half_m));
    table.rows.push_back({part.name, "movable part", place_text(box.centre_m + file.origin_m()),
                          size_text(sides_m), fmt::format("{}", fmt::join(what, ", "))});
  }
  for (const Portal& portal : portals) {
    const std::string opened_by = names_of_parts(portal, parts);
    table.rows.push_back({portal.name, "portal", place_text(portal.centre_m + file.origin_m()),
                          size_text({2 * length(portal.half_u_m), 2 * length(portal.half_v_m)}),
                          (portal.is_baked_closed ? "baked open and closed" : "baked open") +
                              (opened_by.empty() ? "" : ", opened and closed by " + opened_by)});
  }
  table.folded = table.rows.size() > 12;
  page.table(std::move(table));
}

}  // namespace clamor
