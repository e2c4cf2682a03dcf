// inspect_command.cpp: clamor inspect: what a bake file holds.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <ostream>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <nlohmann/json.hpp>

#include "common/air.h"
#include "formats/bake_file.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/progress.h"

namespace clamor {

namespace {

constexpr std::size_t kShownEmitters = 12, kShownInputs = 6;

double decibels(double power) { return power > 0 ? 10 * std::log10(power) : -INFINITY; }

double sum(const Bands& bands) {
  double total = 0;
  for (const float value : bands) total += value;
  return total;
}

// A name that may come from anywhere, without what would steer the terminal.
std::string printable(std::string name) {
  for (char& c : name)
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
  return name;
}

// Words as a shell takes them.
std::string as_typed(const std::string& word) {
  const bool plain = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("-_./:,=+%").find(static_cast<char>(c)) != std::string_view::npos;
  });
  if (plain) return word;
  std::string enclosed = "'";
  for (const char c : word) enclosed += c == '\'' ? "'\\''" : std::string(1, c);
  return enclosed + "'";
}

// What makes the file again.
std::string command_of(const BakeFile& file) {
  std::string command = "clamor bake " + as_typed(file.provenance().level) + " -o " +
                        as_typed(std::filesystem::path(file.path()).filename().string());
  for (const std::string& word : file.provenance().arguments) command += " " + as_typed(word);
  return command;
}

std::uint64_t secondary_count(const BakeFile& file) {
  return file.source_count() - std::min<std::uint64_t>(file.source_count(), file.emitters().size());
}

double escaped_share(const BakeStatistics& statistics) {
  return statistics.photons_traced == 0 ? 0
                                        : static_cast<double>(statistics.photons_escaped) /
                                              static_cast<double>(statistics.photons_traced);
}

// Of all trees, by depth.
std::vector<OctreeLevel> depths_of(const BakeFile& file) {
  std::vector<OctreeLevel> depths;
  for (const auto& levels : file.levels()) {
    depths.resize(std::max(depths.size(), levels.size()));
    for (std::size_t d = 0; d < levels.size(); ++d) {
      depths[d].nodes += levels[d].nodes;
      depths[d].sources += levels[d].sources;
      depths[d].packed_bytes += levels[d].packed_bytes;
      for (std::size_t b = 0; b < kBandCount; ++b) depths[d].power[b] += levels[d].power[b];
    }
  }
  return depths;
}

template <class Format>
std::string row(const char* title, const Bands& bands, Format format) {
  std::string line = fmt::format("  {:<22}", title);
  for (const float value : bands) line += fmt::format("{:>8}", format(value));
  return line + '\n';
}

std::string header_row(const char* title) {
  std::string line = fmt::format("{:<24}", title);
  for (const double hz : kBandCentres_hz)
    line += fmt::format(
        "{:>8}", hz < 1000 ? fmt::format("{:.0f} Hz", hz) : fmt::format("{:.0f} kHz", hz / 1000));
  return line + '\n';
}

// "violin.flac (44 100 bytes, 0123456789abcdef)"; of many, the first few.
std::vector<std::string> inputs_of(const Provenance& provenance) {
  std::vector<std::string> lines;
  for (const InputFile& input : provenance.inputs) {
    if (lines.size() == kShownInputs) {
      lines.push_back(fmt::format("and {} more", provenance.inputs.size() - kShownInputs));
      break;
    }
    lines.push_back(fmt::format("{} ({} bytes, {:016x})", input.name, input.bytes, input.hash));
  }
  return lines;
}

// "title  one, two,", as many to a line as fit.
void print_list(const char* title, const std::vector<std::string>& items, std::ostream& out) {
  constexpr std::size_t kWidth = 100;
  std::string line;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string item = printable(items[i]) + (i + 1 < items.size() ? "," : "");
    if (!line.empty() && line.size() + 1 + item.size() > kWidth - 12) {
      fmt::print(out, "{:<12}{}\n", title, line);
      title = "";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + item;
  }
  if (!line.empty()) fmt::print(out, "{:<12}{}\n", title, line);
}

std::string decay_row(const DecaySummary& decay) {
  std::string row;
  for (std::size_t b = 0; b < kBandCount; ++b)
    row += fmt::format("{}{}", b > 0 ? ", " : "",
                       decay.t30_s[b] > 0 ? fmt::format("{:.2f}", decay.t30_s[b]) : "-");
  const bool dry =
      std::all_of(decay.t30_s.begin(), decay.t30_s.end(), [](float s) { return s == 0; });
  return fmt::format("decays      {}\n",
                     dry ? "too dry to tell a T30" : "T30 " + row + " s from 63 Hz to 8 kHz");
}

void print_tables(const BakeFile& file, std::ostream& out) {
  const BakeSettings& settings = file.settings();
  const BakeStatistics& statistics = file.statistics();
  const auto emitters = static_cast<std::uint64_t>(file.emitters().size());
  const BakeBytes bytes = file.bytes();

  fmt::print(out, "{}: Clamor bake, format {}.{}\n", file.path(), file.major(), file.minor());
  for (const auto& warning : statistics.warnings)
    fmt::print(out, "  warning: {}\n", printable(warning));
  const Provenance& provenance = file.provenance();
  fmt::print(out, "\nmade by     {} from {} (inputs {:016x})\n", printable(provenance.tool),
             printable(provenance.level), provenance.input_hash);
  print_list("read", inputs_of(provenance), out);
  print_list("using", provenance.libraries, out);
  fmt::print(out, "with        {}\n", printable(command_of(file)));
  fmt::print(out,
             "settings    seed {}, {} photons, up to {} reflections, kappa {}, paths up to {} s\n",
             settings.seed, settings.photons, settings.sources, settings.roulette_kappa,
             settings.longest_path_s);
  fmt::print(out, "air         {} C, {} % humidity, {} kPa: sound travels at {:.1f} m/s\n",
             settings.air.temperature_c, settings.air.humidity_percent, settings.air.pressure_kpa,
             speed_of_sound_mps(settings.air));
  fmt::print(out, "traced      {} photons, {} bounces, mean free path {:.2f} m, {:.1f} % escaped\n",
             statistics.photons_traced, statistics.bounces, statistics.mean_free_path_m,
             100 * escaped_share(statistics));
  if (statistics.decay.places > 0) out << decay_row(statistics.decay);
  fmt::print(out, "sources     {}: {} emitters, {} secondary\n", file.source_count(), emitters,
             secondary_count(file));
  const auto megabytes = [](std::uint64_t n) { return static_cast<double>(n) / 1e6; };
  fmt::print(
      out,
      "bytes       {:.2f} MB: pages {:.2f} ({:.1f} per source, packed {:.2f} times), signals "
      "{:.2f}, geometry {:.2f}, root {:.2f}\n",
      megabytes(bytes.file), megabytes(bytes.pages),
      static_cast<double>(bytes.pages) /
          static_cast<double>(std::max<std::uint64_t>(1, file.source_count())),
      static_cast<double>(bytes.pages_unpacked) /
          static_cast<double>(std::max<std::uint64_t>(1, bytes.pages)),
      megabytes(bytes.signals), megabytes(bytes.geometry), megabytes(bytes.root));

  fmt::print(out, "\nemitters    {}\n", emitters);
  for (std::size_t i = 0; i < std::min<std::size_t>(kShownEmitters, emitters); ++i) {
    const Emitter& emitter = file.emitters()[i];
    fmt::print(out, "  {:<22} at {:8.2f} {:7.2f} {:8.2f}  gain {:+6.1f} dB  starts {:.3f} s\n",
               printable(emitter.name), emitter.position_m.x, emitter.position_m.y,
               emitter.position_m.z, 2 * decibels(emitter.gain), emitter.delay_s);
  }
  if (emitters > kShownEmitters) fmt::print(out, "  ... and {} more\n", emitters - kShownEmitters);

  fmt::print(out, "\n{}", header_row("absorption"));
  for (const Material& material : file.materials())
    out << row(printable(material.name).c_str(), material.absorption,
               [](float value) { return fmt::format("{:.2f}", value); });
  fmt::print(out, "\n{}", header_row("power, dB"));
  const auto as_db = [](float power) {
    return power > 0 ? fmt::format("{:.1f}", decibels(power)) : "-";
  };
  out << row("emitted", statistics.power_emitted, as_db);
  if (file.top() != nullptr) out << row("in all sources", file.top()->power, as_db);
  out << row("escaped", statistics.power_escaped, as_db);
  if (sum(statistics.power_unfinished) > 0)
    out << row("cut at the longest path", statistics.power_unfinished, as_db);

  fmt::print(out, "\noctree level   nodes    sources   kB packed\n");
  const auto depths = depths_of(file);
  for (std::size_t d = 0; d < depths.size(); ++d)
    fmt::print(out, "{:>12} {:>7} {:>10} {:>11.1f}\n", d, depths[d].nodes, depths[d].sources,
               static_cast<double>(depths[d].packed_bytes) / 1e3);
}

// A number as it was rounded, or null.
nlohmann::ordered_json rounded(float value) {
  if (!(value > 0)) return nullptr;
  return std::round(static_cast<double>(value) * 1e3) / 1e3;
}

nlohmann::ordered_json as_json(const BakeFile& file) {
  const BakeSettings& settings = file.settings();
  const BakeStatistics& statistics = file.statistics();
  const BakeBytes bytes = file.bytes();
  nlohmann::ordered_json json;
  json["format"] = {{"major", file.major()}, {"minor", file.minor()}};
  json["bands_hz"] = nlohmann::ordered_json::array();
  for (const double hz : kBandCentres_hz) json["bands_hz"].push_back(static_cast<int>(hz));
  json["sources"] = {{"total", file.source_count()},
                     {"emitters", file.emitters().size()},
                     {"secondary", secondary_count(file)}};
  json["bytes"] = {{"file", bytes.file},         {"pages", bytes.pages},
                   {"root", bytes.root},         {"signals", bytes.signals},
                   {"geometry", bytes.geometry}, {"pages_unpacked", bytes.pages_unpacked}};
  json["photons"] = {
      {"traced", statistics.photons_traced}, {"escaped_share", escaped_share(statistics)},
      {"bounces", statistics.bounces},       {"deposits", statistics.deposits},
      {"rooms", statistics.rooms},           {"mean_free_path_m", statistics.mean_free_path_m}};
  json["power"] = {{"emitted", statistics.power_emitted},
                   {"escaped", statistics.power_escaped},
                   {"unfinished", statistics.power_unfinished}};
  json["settings"] = {{"seed", settings.seed},
                      {"photons", settings.photons},
                      {"sources", settings.sources},
                      {"roulette_kappa", settings.roulette_kappa},
                      {"longest_path_s", settings.longest_path_s},
                      {"temperature_c", settings.air.temperature_c},
                      {"humidity_percent", settings.air.humidity_percent},
                      {"pressure_kpa", settings.air.pressure_kpa}};
  json["provenance"] = {{"tool", file.provenance().tool},
                        {"level", file.provenance().level},
                        {"input_hash", fmt::format("{:016x}", file.provenance().input_hash)},
                        {"libraries", file.provenance().libraries},
                        {"command", command_of(file)}};
  json["provenance"]["inputs"] = nlohmann::ordered_json::array();
  for (const InputFile& input : file.provenance().inputs)
    json["provenance"]["inputs"].push_back({{"name", input.name},
                                            {"bytes", input.bytes},
                                            {"hash", fmt::format("{:016x}", input.hash)}});
  const DecaySummary& decay = statistics.decay;
  json["decay"] = {{"places", decay.places}, {"error_db", rounded(decay.error_db)}};
  for (const char* key : {"t30_s", "t30_error_s"})
    json["decay"][key] = nlohmann::ordered_json::array();
  for (std::size_t b = 0; b < kBandCount; ++b) {
    json["decay"]["t30_s"].push_back(rounded(decay.t30_s[b]));
    json["decay"]["t30_error_s"].push_back(rounded(decay.t30_error_s[b]));
  }
  json["materials"] = nlohmann::ordered_json::array();
  for (const Material& material : file.materials())
    json["materials"].push_back({{"name", material.name},
                                 {"absorption", material.absorption},
                                 {"scattering", material.scattering},
                                 {"phong", material.phong},
                                 {"transmission", material.transmission}});
  json["emitters"] = nlohmann::ordered_json::array();
  for (const Emitter& emitter : file.emitters())
    json["emitters"].push_back(
        {{"name", emitter.name},
         {"position_m", {emitter.position_m.x, emitter.position_m.y, emitter.position_m.z}},
         {"axis", {emitter.axis.x, emitter.axis.y, emitter.axis.z}},
         {"gain", emitter.gain},
         {"directivity", emitter.directivity},
         {"signal", emitter.signal},
         {"delay_s", emitter.delay_s}});
  json["octree"] = nlohmann::ordered_json::array();
  for (const OctreeLevel& depth : depths_of(file))
    json["octree"].push_back(
        {{"nodes", depth.nodes}, {"sources", depth.sources}, {"packed_bytes", depth.packed_bytes}});
  json["warnings"] = statistics.warnings;
  return json;
}

Result<void> print_pages(const BakeFile& file, std::ostream& out) {
  fmt::print(out, "  tree depth      offset    bytes sources children copies\n");
  return file.for_each_page([&](const PageEntry& entry, const OctreePage& page, std::size_t tree,
                                std::size_t depth) -> Result<void> {
    fmt::print(out, "{:>6} {:>5} {:>11} {:>8} {:>7} {:>8} {:>6}\n", tree, depth, entry.page.offset,
               entry.page.bytes(), entry.source_count, page.links.children.size(),
               page.links.instances.size());
    return {};
  });
}

// Decodes everything there is.
Result<void> verify(const BakeFile& file) {
  const auto pages = file.for_each_page(
      [](const PageEntry&, const OctreePage&, std::size_t, std::size_t) { return Result<void>(); });
  if (!pages.ok()) return pages;
  for (std::size_t i = 0; i < file.signal_count(); ++i)
    if (const auto signal = file.read_signal(i); !signal.ok()) return signal.error();
  if (const auto mesh = file.read_mesh(); !mesh.ok()) return mesh.error();
  return {};
}

}  // namespace

int run_inspect(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string path;
  bool json = false, pages = false, whole = false;
  Arguments parser("inspect", "Prints what a bake file holds and how it was made.",
                   "clamor inspect hall.clamor --pages | sort -k3 -n | tail -5");
  parser.positional("file", path, "the bake file");
  parser.flag("--json", json, "everything, for programs; see formats/bake_format.md");
  parser.flag("--pages", pages, "also a line per page: number, offset, bytes, sources");
  parser.flag("--verify", whole,
              "decode every page, signal and triangle and name the first bad one");
  if (const auto code = parser.parse(arguments, out, err)) return *code;

  const auto file = BakeFile::open(path);
  if (!file.ok()) {
    fmt::print(err, "clamor inspect: {}\n", file.error().message);
    return kBadInput;
  }
  if (whole) {
    if (const auto good = verify(*file); !good.ok()) {
      fmt::print(err, "clamor inspect: {}\n", good.error().message);
      return kBadInput;
    }
  }
  if (json) {
    using Json = nlohmann::ordered_json;  // names need not be UTF-8, JSON must
    out << as_json(*file).dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    return kSuccess;
  }
  print_tables(*file, out);
  if (pages) {
    out << '\n';
    if (const auto done = print_pages(*file, out); !done.ok()) {
      fmt::print(err, "clamor inspect: {}\n", done.error().message);
      return kBadInput;
    }
  }
  if (whole) fmt::print(out, "\nverified: every page, signal and triangle is whole\n");
  return kSuccess;
}

}  // namespace clamor
