#include "tools/commands/inspect_tables.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/report/level_report.h"
#include "common/air.h"
#include "common/counted_texts.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/image_source.h"
#include "formats/level/movable_part.h"
#include "runtime/engine/signal_store.h"
#include "tools/program/text_format.h"
#include "tools/report/level_findings.h"

namespace clamor {

namespace {

constexpr std::size_t kShownGroups = 12, kShownInputs = 6, kShownMaterials = 20;
constexpr std::size_t kWidth = 100;

std::string as_percent(double share) {
  return share <= 0 ? "-" : share < 0.0005 ? "<0.1" : fmt::format("{:.1f}", 100 * share);
}

double share_of(double part, double whole) { return whole > 0 ? part / whole : 0; }

std::string as_megabytes(std::uint64_t bytes) {
  return fmt::format("{:.2f}", static_cast<double>(bytes) / 1e6);
}

// Number of list entries to show; a line that says "1 more" would save nothing.
std::size_t shown_of(std::size_t all, std::size_t most) { return all <= most + 1 ? all : most; }

template <class Values, class Format>
std::string row(const std::string& title, const Values& values, Format format) {
  std::string line = fmt::format("  {:<24}", title);
  for (const auto value : values) line += fmt::format("{:>8}", format(value));
  return line;
}

std::string band_header(const char* title) {
  std::string line = fmt::format("{:<26}", title);
  for (std::size_t b = 0; b < kBandCount; ++b) line += fmt::format("{:>8}", band_title(b));
  return line;
}

// Prints "title  one, two," with as many items to a line as fit.
void print_list(const char* title, const std::vector<std::string>& items, std::ostream& out) {
  std::string line;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string item = printable(items[i]) + (i + 1 < items.size() ? "," : "");
    if (!line.empty() && line.size() + 1 + item.size() > kWidth - 12) {
      fmt::print(out, "  {:<10}{}\n", title, line);
      title = "";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + item;
  }
  if (!line.empty()) fmt::print(out, "  {:<10}{}\n", title, line);
}

// Formats inputs as "violin.flac (44 100 bytes, 0123456789abcdef)"; only the first few of many.
std::vector<std::string> inputs_of(const Provenance& provenance) {
  std::vector<std::string> lines;
  for (const InputFile& input : provenance.inputs) {
    if (lines.size() == kShownInputs && provenance.inputs.size() > kShownInputs + 1) {
      lines.push_back(fmt::format("and {} more", provenance.inputs.size() - kShownInputs));
      break;
    }
    lines.push_back(
        fmt::format("{} ({} bytes, {:016x})", input.name, grouped(input.bytes), input.hash));
  }
  return lines;
}

void print_title(const BakeFile& file, const BakeOverview& overview, std::ostream& out) {
  fmt::print(out, "{}: Clamor bake, format {}.{}, {} MB\n", printable(file.path()), file.major(),
             file.minor(), as_megabytes(file.bytes().file));
  fmt::print(out, "  {} and {} in {}, made by {}\n", counted(overview.emitter_count, "emitter"),
             counted(overview.secondary, "secondary source"), printable(file.provenance().level),
             printable(file.provenance().tool));
  if (file.stored_sources() != file.source_count())
    fmt::print(out, "  {} of them are stored; the others are instances\n",
               grouped(file.stored_sources()));
  const BakeStatistics& statistics = file.statistics();
  const auto print = [&](const char* what, const std::string& text) {
    if (text.empty()) return;
    fmt::print(out, "  {}: {}\n", what, printable(text));
    if (const auto place_m = place_in(text))
      fmt::print(out, "    {}\n", printable(view_command(file.path(), *place_m)));
  };
  for (const auto& warning : with_counts(statistics.warnings)) print("warning", warning);
  const LevelFindings& found = statistics.findings;
  if (std::ranges::find(statistics.warnings, found.closedness) == statistics.warnings.end())
    print("level", found.closedness);
  print("level", gap_line(found));
}

void print_making(const BakeFile& file, const BakeOverview& overview, std::ostream& out) {
  const std::vector<MakingLine> lines = making_lines(file, overview);
  fmt::print(out, "\nhow it was made (inputs {:016x})\n", file.provenance().input_hash);
  const auto print_line = [&out](const MakingLine& line) {
    fmt::print(out, "  {:<10}{}\n", line.title, printable(line.text));
  };
  print_line(lines[0]);
  print_list("from", inputs_of(file.provenance()), out);
  print_list("using", file.provenance().libraries, out);
  for (std::size_t i = 1; i < lines.size(); ++i) print_line(lines[i]);
}

void print_sound(const BakeFile& file, const BakeOverview& overview, std::ostream& out) {
  fmt::print(out, "\n{}\n", band_header("acoustics"));
  const DecaySummary& decay = file.statistics().decay;
  if (decay.places > 0 && is_too_dry(decay)) out << "  too dry for a T30\n";
  for (const BandRow& line : acoustic_rows(file, overview)) {
    out << fmt::format("  {:<24}", line.title);
    for (std::size_t b = 0; b < kBandCount; ++b) out << fmt::format("{:>8}", line.text(b));
    out << '\n';
  }
}

void print_emitters(const BakeFile& file, const BakeOverview& overview, std::ostream& out) {
  const std::string listed = counted(file.emitters().size(), "emitter");
  fmt::print(out, "\n{:<26}{:>8}  {:>8} {:>8} {:>9}  {}\n",
             file.emitters().size() < overview.emitter_count ? listed + " stored" : listed, "gain",
             "direct.", "delay", "count", "position");
  const std::size_t shown = shown_of(overview.emitters.size(), kShownGroups);
  for (std::size_t i = 0; i < shown; ++i) {
    const EmitterGroup& group = overview.emitters[i];
    const Emitter& emitter = file.emitters()[group.first];
    const bool one = group.count == 1;
    const auto place = [](const Vec3& at) {
      return fmt::format("{:.2f} {:.2f} {:.2f}", at.x, at.y, at.z);
    };
    const float beam = *std::max_element(emitter.directivity.begin(), emitter.directivity.end());
    fmt::print(out, "  {:<24}{:>8}  {:>8} {:>8} {:>9}  {}\n", shortened(group.name, 24),
               fmt::format("{:+.1f} dB", 2 * decibels_of(emitter.gain)),
               beam > 0 ? fmt::format("p {:.2g}", beam) : "omni",
               one ? fmt::format("{:.2f} s", group.min_delay_s)
                   : fmt::format("0-{:.2f} s", group.max_delay_s),
               grouped(group.count),
               one ? place(group.low_m) : place(group.low_m) + " to " + place(group.high_m));
  }
  if (overview.emitters.size() > shown)
    fmt::print(out, "  and {} more kinds (--json has all)\n", overview.emitters.size() - shown);
}

void print_portals(const BakeFile& file, std::ostream& out) {
  const BakedPortals& baked = file.portals();
  if (baked.portals.empty()) return;
  fmt::print(out, "\n{:<26}{:>8} {:>8}  {}\n", counted(baked.portals.size(), "portal"), "width",
             "height", "centre");
  const std::size_t shown = shown_of(baked.portals.size(), kShownGroups);
  for (std::size_t i = 0; i < shown; ++i) {
    const Portal& portal = baked.portals[i];
    const Vec3 centre_m = portal.centre_m + file.origin_m();
    const std::string opened_by = names_of_parts(portal, file.movable_parts());
    fmt::print(out, "  {:<24}{:>8} {:>8}  {:.2f} {:.2f} {:.2f}{}\n", shortened(portal.name, 24),
               fmt::format("{:.2f} m", 2 * length(portal.half_u_m)),
               fmt::format("{:.2f} m", 2 * length(portal.half_v_m)), centre_m.x, centre_m.y,
               centre_m.z, opened_by.empty() ? "" : "  opened by " + shortened(opened_by, 40));
  }
  if (baked.portals.size() > shown)
    fmt::print(out, "  and {} more (--json has all)\n", baked.portals.size() - shown);
  fmt::print(out, "  sound passed {} of them, and {} of an emitter and a set have reflections\n",
             counted(baked.sets.size() - 1, "set"), counted(baked.emitters.size(), "pair"));
}

void print_materials(const BakeFile& file, const BakeOverview& overview, std::ostream& out) {
  fmt::print(out, "\n{} 1 kHz: scatter.  Phong trans.\n",
             band_header((counted(file.materials().size(), "material") + ": absorption").c_str()));
  const std::size_t shown = shown_of(overview.materials.size(), kShownMaterials);
  for (std::size_t i = 0; i < shown; ++i) {
    const MaterialGroup& group = overview.materials[i];
    const Material& material = file.materials()[group.first];
    const std::string more =
        group.names.size() > 1 ? fmt::format(" +{} equal", group.names.size() - 1) : "";
    const double through = material.transmission[4];
    // A surface that scatters everything has no lobe.
    const std::string lobe = material.scattering[4] >= 1 ? "-"
                             : material.phong[4] >= kMirrorExponent
                                 ? "mirror"
                                 : fmt::format("{:.0f}", material.phong[4]);
    fmt::print(out, "{} {:>15.2f} {:>6} {:>6}\n",
               row(shortened(group.names.front(), 24 - more.size()) + more, material.absorption,
                   [](float value) { return fmt::format("{:.2f}", value); }),
               material.scattering[4], lobe, through > 0 ? fmt::format("{:.2f}", through) : "-");
  }
  if (overview.materials.size() > shown)
    fmt::print(out, "  and {} more kinds (--json has all)\n", overview.materials.size() - shown);
}

void print_probes(const BakeFile& file, std::ostream& out) {
  const StoredProbes& probes = file.probes();
  if (probes.places.empty()) return;
  std::uint64_t early = 0, late = 0;
  for (const StoredProbe& probe : probes.places) early += probe.tree.top.sources_below;
  for (const StoredTree& zone : probes.zones) late += zone.top.sources_below;
  fmt::print(
      out, "\n{} in {}, for moving sources: {} early and {} late reflections, {:.0f} kB a probe\n",
      counted(probes.places.size(), "probe"), counted(probes.zones.size(), "zone"), grouped(early),
      grouped(late),
      static_cast<double>(file.bytes().probes) / 1e3 / static_cast<double>(probes.places.size()));
}

void print_images(const BakeFile& file, std::ostream& out) {
  if (file.images().empty()) return;
  fmt::print(out, "\n{} of emitters in mirrors, of up to {}\n",
             counted(file.images().size(), "image source"),
             counted(static_cast<std::uint64_t>(file.settings().early_order), "reflection"));
}

void print_movable_parts(const BakeFile& file, std::ostream& out) {
  const std::vector<MovablePart>& parts = file.movable_parts();
  if (parts.empty()) return;
  fmt::print(out, "\n{:<36}{:>10}  position at rest\n", counted(parts.size(), "movable part"),
             "triangles");
  const std::size_t shown = shown_of(parts.size(), kShownGroups);
  for (std::size_t i = 0; i < shown; ++i) {
    const Vec3 at = parts[i].rest_pose.position_m + file.origin_m();
    fmt::print(out, "  {:<34}{:>10}  {:.2f} {:.2f} {:.2f}\n", shortened(parts[i].name, 34),
               grouped(parts[i].mesh.triangles.size()), at.x, at.y, at.z);
  }
  if (parts.size() > shown)
    fmt::print(out, "  and {} more (--json has all)\n", parts.size() - shown);
}

void print_shares(const BakeOverview& overview, std::ostream& out) {
  const auto shares_of = [&](const Bands& power) {
    std::array<double, kBandCount> shares;
    for (std::size_t b = 0; b < kBandCount; ++b)
      shares[b] = share_of(static_cast<double>(power[b]), static_cast<double>(overview.power[b]));
    return shares;
  };
  fmt::print(out, "\n{}\n", band_header("power by octree depth, %"));
  for (std::size_t d = 0; d < overview.depths.size(); ++d)
    out << row(depth_title(d), shares_of(overview.depths[d].power), as_percent) << '\n';
  if (overview.instanced.trees > 0)
    out << row("in instances", shares_of(overview.instanced.stored.power), as_percent) << '\n';
}

void print_octree(const BakeFile& file, const BakeOverview& overview, std::ostream& out) {
  fmt::print(out, "\n{:<26}{:>8}{:>12}{:>8}{:>10}{:>14}\n", "octree", "nodes", "sources", "%", "kB",
             "bytes/source");
  const auto line = [&](const std::string& title, const OctreeDepth& level) {
    const auto sources = static_cast<double>(level.sources);
    fmt::print(out, "  {:<24}{:>8}{:>12}{:>8}{:>10.1f}{:>14.1f}\n", title, level.nodes,
               grouped(level.sources),
               as_percent(share_of(sources, static_cast<double>(file.stored_sources()))),
               static_cast<double>(level.packed_bytes) / 1e3,
               share_of(static_cast<double>(level.packed_bytes), sources));
  };
  for (std::size_t d = 0; d < overview.depths.size(); ++d)
    line(fmt::format("depth {}", d), overview.depths[d]);
  if (overview.instanced.trees > 0)
    line(counted(overview.instanced.trees, "instanced tree"), overview.instanced.stored);
}

void print_bytes(const BakeFile& file, std::ostream& out) {
  const BakeBytes bytes = file.bytes();
  const auto sources = static_cast<double>(file.stored_sources());
  fmt::print(out, "\n{:<26}{:>8}{:>12}{:>22}\n", "bytes", "MB", "% of file", "bytes/source");
  const auto section = [&](const char* title, std::uint64_t size) {
    fmt::print(out, "  {:<24}{:>8}{:>12}{:>22.2f}\n", title, as_megabytes(size),
               as_percent(share_of(static_cast<double>(size), static_cast<double>(bytes.file))),
               share_of(static_cast<double>(size), sources));
  };
  for (const ByteSection& part : byte_sections(file)) section(part.title, part.bytes);
  fmt::print(out, "  {}: {:.2f} times smaller than unpacked ({} MB)\n",
             counted(file.page_count(), "page"),
             share_of(static_cast<double>(bytes.pages_unpacked), static_cast<double>(bytes.pages)),
             as_megabytes(bytes.pages_unpacked));
  if (file.signal_count() > 0)
    fmt::print(out, "  signals: {}, {} MB decoded\n", counted(file.signal_count(), "sound"),
               as_megabytes(decoded_sounds_bytes(file)));
  std::uint64_t triangles = 0;
  for (std::size_t i = 0; i < file.geometry_page_count(); ++i)
    triangles += file.geometry_page(i).triangles;
  if (triangles > 0)
    fmt::print(out, "  geometry: {} in {}\n", counted(triangles, "triangle"),
               counted(file.geometry_page_count(), "page"));
}

}  // namespace

void print_tables(const BakeFile& file, const BakeOverview& overview, std::ostream& out) {
  print_title(file, overview, out);
  print_sound(file, overview, out);
  print_emitters(file, overview, out);
  print_portals(file, out);
  print_materials(file, overview, out);
  print_images(file, out);
  print_probes(file, out);
  print_movable_parts(file, out);
  if (file.top() != nullptr) {
    print_shares(overview, out);
    print_octree(file, overview, out);
  }
  print_bytes(file, out);
  print_making(file, overview, out);
}

Result<void> print_pages(const BakeFile& file, std::ostream& out) {
  fmt::print(out, "  tree depth      offset    bytes sources children instances\n");
  const auto of_sources =
      file.for_each_page([&](const PageEntry& entry, const OctreePage& page, std::size_t tree,
                             std::size_t depth) -> Result<void> {
        fmt::print(out, "{:>6} {:>5} {:>11} {:>8} {:>7} {:>8} {:>6}\n", tree, depth,
                   entry.page.offset, entry.page.bytes(), entry.source_count,
                   page.links.children.size(), page.links.instances.size());
        return {};
      });
  if (!of_sources.ok() || file.geometry_page_count() == 0) return of_sources;
  fmt::print(out, "\n  geometry        offset    bytes triangles vertices\n");
  for (std::size_t i = 0; i < file.geometry_page_count(); ++i) {
    const GeometryPageInfo page = file.geometry_page(i);
    fmt::print(out, "{:>10} {:>13} {:>8} {:>9} {:>8}\n", i + 1, page.offset, page.packed_bytes,
               page.triangles, page.vertices);
  }
  return {};
}

}  // namespace clamor
