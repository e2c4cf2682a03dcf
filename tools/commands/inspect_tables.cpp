#include "tools/commands/inspect_tables.h"

#include <algorithm>
#include <functional>
#include <ostream>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/report/level_report.h"
#include "common/air.h"
#include "common/counted_texts.h"
#include "tools/analysis/json_values.h"
#include "tools/program/text_format.h"
#include "tools/report/level_findings.h"

namespace clamor {

namespace {

constexpr std::size_t kShownGroups = 12, kShownInputs = 6, kShownMaterials = 20, kShownDeciding = 6;
constexpr std::size_t kWidth = 100;

std::string as_percent(double share) {
  return share <= 0 ? "-" : share < 0.0005 ? "<0.1" : fmt::format("{:.1f}", 100 * share);
}

double share_of(double part, double whole) { return whole > 0 ? part / whole : 0; }

std::string as_megabytes(double bytes) { return fmt::format("{:.2f}", bytes / 1e6); }

Vec3 as_vector(const OrderedJson& list) { return {list[0], list[1], list[2]}; }

std::string as_place(const OrderedJson& list) {
  const Vec3 at = as_vector(list);
  return fmt::format("{:.2f} {:.2f} {:.2f}", at.x, at.y, at.z);
}

// Number of list entries to show; a line that says "1 more" would save nothing.
std::size_t shown_of(std::size_t all, std::size_t most) { return all <= most + 1 ? all : most; }

template <class Values, class Format>
std::string row(const std::string& title, const Values& values, Format format) {
  std::string line = fmt::format("  {:<24}", title);
  for (const auto& value : values) line += fmt::format("{:>8}", format(value));
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
  const std::size_t shown = shown_of(provenance.inputs.size(), kShownInputs);
  for (const InputFile& input : std::span(provenance.inputs).first(shown))
    lines.push_back(
        fmt::format("{} ({} bytes, {:016x})", input.name, grouped(input.bytes), input.hash));
  if (provenance.inputs.size() > shown)
    lines.push_back(fmt::format("and {} more", provenance.inputs.size() - shown));
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

// Ends a list of which only the first were printed.
void print_rest(std::size_t all, std::size_t shown, const char* things, std::ostream& out) {
  if (all > shown) fmt::print(out, "  and {} more{} (--json has all)\n", all - shown, things);
}

void print_sound(const BakeFile& file, const BakeOverview& overview, const OrderedJson& bake,
                 std::ostream& out) {
  fmt::print(out, "\n{}\n", band_header("acoustics"));
  const DecaySummary& decay = file.statistics().decay;
  if (decay.places > 0 && has_no_t30(decay)) out << "  " << kNoT30 << '\n';
  for (const BandRow& line : acoustic_rows(file, overview))
    out << row(line.title, line.texts, std::identity()) << '\n';
  const OrderedJson& materials = bake["decay"]["materials"];
  if (materials.empty()) return;
  fmt::print(out, "\n{}\n", band_header("T30 for 0.01 more, s"));
  const std::size_t shown = shown_of(materials.size(), kShownDeciding);
  for (std::size_t i = 0; i < shown; ++i)
    out << row(shortened(materials[i]["name"], 24), materials[i]["t30_slope_s"],
               [](double slope_s) {
                 return slope_s < 0 ? fmt::format("{:.3f}", slope_s / 100) : "-";
               })
        << '\n';
  print_rest(materials.size(), shown, "", out);
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
  print_rest(overview.emitters.size(), shown, " kinds", out);
}

// The parts that open and close a portal, as "'Left', 'Right'"; "" if it has none.
std::string names_of_parts(const OrderedJson& portal, const OrderedJson& parts) {
  std::string names;
  for (const std::size_t part : portal["parts"])
    names += (names.empty() ? "" : ", ") + in_quotes(parts[part]["name"].get<std::string>());
  return names;
}

void print_portals(const OrderedJson& bake, std::ostream& out) {
  const OrderedJson &all = bake["portals"], &portals = all["list"];
  if (portals.empty()) return;
  fmt::print(out, "\n{:<26}{:>8} {:>8}  {}\n", counted(portals.size(), "portal"), "width", "height",
             "centre");
  const std::size_t shown = shown_of(portals.size(), kShownGroups);
  for (std::size_t i = 0; i < shown; ++i) {
    const OrderedJson& portal = portals[i];
    const std::string opened_by = names_of_parts(portal, bake["movable_parts"]);
    fmt::print(out, "  {:<24}{:>8} {:>8}  {}{}\n", shortened(portal["name"], 24),
               fmt::format("{:.2f} m", 2 * length(as_vector(portal["half_u_m"]))),
               fmt::format("{:.2f} m", 2 * length(as_vector(portal["half_v_m"]))),
               as_place(portal["centre_m"]),
               opened_by.empty() ? "" : "  opened by " + shortened(opened_by, 40));
  }
  print_rest(portals.size(), shown, "", out);
  fmt::print(out, "  sound passed {} of them, and {} of an emitter and a set have reflections\n",
             counted(all["sets"].get<std::size_t>() - 1, "set"),
             counted(all["virtual_emitters"], "pair"));
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
  print_rest(overview.materials.size(), shown, " kinds", out);
}

void print_probes(const OrderedJson& bake, std::ostream& out) {
  const OrderedJson& probes = bake["probes"];
  const std::size_t places = probes["places"].size();
  if (places == 0) return;
  fmt::print(
      out, "\n{} in {}, for moving sources: {} early and {} late reflections, {:.0f} kB a probe\n",
      counted(places, "probe"), counted(probes["zones"], "zone"), grouped(probes["early_sources"]),
      grouped(probes["late_sources"]),
      probes["bytes"].get<double>() / 1e3 / static_cast<double>(places));
}

void print_images(const OrderedJson& bake, std::ostream& out) {
  if (bake["images"] > 0)
    fmt::print(out, "\n{} of emitters in mirrors, of up to {}\n",
               counted(bake["images"], "image source"),
               counted(bake["settings"]["early_order"], "reflection"));
}

void print_movable_parts(const OrderedJson& parts, std::ostream& out) {
  if (parts.empty()) return;
  fmt::print(out, "\n{:<36}{:>10}  position at rest\n", counted(parts.size(), "movable part"),
             "triangles");
  const std::size_t shown = shown_of(parts.size(), kShownGroups);
  for (std::size_t i = 0; i < shown; ++i)
    fmt::print(out, "  {:<34}{:>10}  {}\n", shortened(parts[i]["name"], 34),
               grouped(parts[i]["triangles"]), as_place(parts[i]["position_m"]));
  print_rest(parts.size(), shown, "", out);
}

void print_shares(const OrderedJson& bake, std::ostream& out) {
  const auto line = [&out](const std::string& title, const OrderedJson& depth) {
    out << row(title, depth["power_share"], as_percent) << '\n';
  };
  fmt::print(out, "\n{}\n", band_header("power by octree depth, %"));
  for (std::size_t d = 0; d < bake["octree"].size(); ++d)
    line(d == 0 ? "depth 0, the first page" : fmt::format("depth {}", d), bake["octree"][d]);
  if (bake["instanced"]["trees"] > 0) line("in instances", bake["instanced"]);
}

void print_octree(const OrderedJson& bake, std::ostream& out) {
  fmt::print(out, "\n{:<26}{:>8}{:>12}{:>8}{:>10}{:>14}\n", "octree", "nodes", "sources", "%", "kB",
             "bytes/source");
  const auto line = [&](const std::string& title, const OrderedJson& depth) {
    const double sources = depth["sources"], bytes = depth["packed_bytes"];
    fmt::print(out, "  {:<24}{:>8}{:>12}{:>8}{:>10.1f}{:>14.1f}\n", title,
               depth["nodes"].get<std::uint64_t>(), grouped(depth["sources"]),
               as_percent(share_of(sources, bake["sources"]["stored"])), bytes / 1e3,
               share_of(bytes, sources));
  };
  for (std::size_t d = 0; d < bake["octree"].size(); ++d)
    line(fmt::format("depth {}", d), bake["octree"][d]);
  if (const OrderedJson& trees = bake["instanced"]; trees["trees"] > 0)
    line(counted(trees["trees"], "instanced tree"), trees);
}

void print_bytes(const BakeFile& file, const OrderedJson& bake, std::ostream& out) {
  const OrderedJson& bytes = bake["bytes"];
  fmt::print(out, "\n{:<26}{:>8}{:>12}{:>22}\n", "bytes", "MB", "% of file", "bytes/source");
  const auto line = [&](const char* name, const OrderedJson& of_section) {
    fmt::print(out, "  {:<24}{:>8}{:>12}{:>22.2f}\n", name, as_megabytes(of_section),
               as_percent(share_of(of_section, bytes["file"])),
               share_of(of_section, bake["sources"]["stored"]));
  };
  for (const char* section : {"pages", "signals", "geometry", "root"})
    line(section, bytes[section]);
  if (const OrderedJson& probes = bake["probes"]["bytes"]; probes > 0) line("probes", probes);
  line("file", bytes["file"]);
  fmt::print(out, "  {}: {:.2f} times smaller than unpacked ({} MB)\n",
             counted(bake["page_count"], "page"), bytes["compression_ratio"].get<double>(),
             as_megabytes(bytes["pages_unpacked"]));
  if (file.signal_count() > 0)
    fmt::print(out, "  signals: {}, {} MB decoded\n", counted(file.signal_count(), "sound"),
               as_megabytes(bytes["signals_decoded"]));
  if (const OrderedJson& geometry = bake["geometry"]; geometry["triangles"] > 0)
    fmt::print(out, "  geometry: {} in {}\n", counted(geometry["triangles"], "triangle"),
               counted(geometry["page_count"], "page"));
}

using Column = std::pair<const char*, int>;  // the key and the width
constexpr Column kPageColumns[] = {{"tree", 5},         {"depth", 5},   {"offset", 11},
                                   {"packed_bytes", 8}, {"sources", 7}, {"children", 8},
                                   {"instances", 6}};
constexpr Column kGeometryColumns[] = {
    {"offset", 13}, {"packed_bytes", 8}, {"triangles", 9}, {"vertices", 8}};

// A line per page.
void print_pages(const OrderedJson& bake, std::ostream& out) {
  const auto print = [&out](const OrderedJson& page, const char* key, int width) {
    fmt::print(out, " {:>{}}", page[key].get<std::uint64_t>(), width);
  };
  fmt::print(out, "\n  tree depth      offset    bytes sources children instances\n");
  for (const OrderedJson& page : bake["pages"]) {
    for (const auto& [key, width] : kPageColumns) print(page, key, width);
    out << '\n';
  }
  if (bake["geometry_pages"].empty()) return;
  fmt::print(out, "\n  geometry        offset    bytes triangles vertices\n");
  for (std::size_t i = 0; i < bake["geometry_pages"].size(); ++i) {
    fmt::print(out, "{:>10}", i + 1);
    for (const auto& [key, width] : kGeometryColumns) print(bake["geometry_pages"][i], key, width);
    out << '\n';
  }
}

}  // namespace

void print_tables(const BakeFile& file, const BakeOverview& overview, const OrderedJson& bake,
                  std::ostream& out) {
  print_title(file, overview, out);
  print_sound(file, overview, bake, out);
  print_emitters(file, overview, out);
  print_portals(bake, out);
  print_materials(file, overview, out);
  print_images(bake, out);
  print_probes(bake, out);
  print_movable_parts(bake["movable_parts"], out);
  if (file.top() != nullptr) {
    print_shares(bake, out);
    print_octree(bake, out);
  }
  print_bytes(file, bake, out);
  print_making(file, overview, out);
  if (bake.contains("pages")) print_pages(bake, out);
}

}  // namespace clamor
