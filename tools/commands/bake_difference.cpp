#include "tools/commands/bake_difference.h"

#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/level/mesh.h"
#include "formats/level/movable_part.h"
#include "formats/level/signal.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

using Field = std::pair<const char*, std::string>;

std::string bands_of(const Bands& bands, const char* format) {
  std::string text;
  for (const float value : bands)
    text += (text.empty() ? "" : " ") + fmt::format(fmt::runtime(format), value);
  return text;
}

std::string place_of(const Vec3& place) {
  return fmt::format("{:.3f} {:.3f} {:.3f}", place.x, place.y, place.z);
}

std::vector<Field> fields_of(const Emitter& emitter) {
  return {{"at", place_of(emitter.position_m)},
          {"faces", place_of(emitter.axis)},
          {"gain", fmt::format("{:.3f}", emitter.gain)},
          {"directivity", bands_of(emitter.directivity, "{:.2g}")},
          {"signal", std::to_string(emitter.signal)},
          {"starts, s", fmt::format("{:.3f}", emitter.delay_s)}};
}

std::vector<Field> fields_of(const Material& material) {
  return {{"absorbs", bands_of(material.absorption, "{:.2f}")},
          {"scatters", bands_of(material.scattering, "{:.2f}")},
          {"phong", bands_of(material.phong, "{:.3g}")},
          {"lets through", bands_of(material.transmission, "{:.2f}")},
          {"rows, m", fmt::format("{:.2f}", material.rows_m)}};
}

std::vector<Field> fields_of(const Portal& portal) {
  return {{"at", place_of(portal.centre_m)},
          {"spans", place_of(portal.half_u_m) + ", " + place_of(portal.half_v_m)}};
}

class Differences {
 public:
  template <class Value>
  void compare(const std::string& what, const Value& a, const Value& b) {
    if (!(a == b)) found_.push_back({what, fmt::format("{}", a), fmt::format("{}", b)});
  }

  // Matches things by name; the n-th of several with one name matches the n-th.
  template <class Thing>
  void compare_named(const std::string& kind, const std::vector<Thing>& a,
                     const std::vector<Thing>& b) {
    const auto in_a = by_name(a), in_b = by_name(b);
    std::vector<std::string> only_a, only_b;
    for (const auto& [key, fields] : in_a) {
      const auto other = in_b.find(key);
      if (other == in_b.end()) {
        only_a.push_back(key.first);
        continue;
      }
      const std::string title = kind + " " + in_quotes(key.first) +
                                (key.second > 0 ? " #" + std::to_string(key.second + 1) : "") + " ";
      for (std::size_t i = 0; i < fields.size(); ++i)
        compare(title + fields[i].first, fields[i].second, other->second[i].second);
    }
    for (const auto& [key, fields] : in_b)
      if (!in_a.contains(key)) only_b.push_back(key.first);
    if (!only_a.empty() || !only_b.empty())
      found_.push_back({kind + "s in one file only", listed(only_a), listed(only_b)});
  }

  std::vector<BakeDifference> take() { return std::move(found_); }

 private:
  template <class Thing>
  static auto by_name(const std::vector<Thing>& all) {
    std::map<std::pair<std::string, std::size_t>, std::vector<Field>> named;
    std::map<std::string, std::size_t> namesakes;
    for (const Thing& thing : all) named[{thing.name, namesakes[thing.name]++}] = fields_of(thing);
    return named;
  }

  // Lists names as "bell, fan (16 403)": names that differ only in a final number are counted.
  static std::string listed(const std::vector<std::string>& names) {
    constexpr std::size_t kMaxNames = 6;
    std::vector<std::pair<std::string, std::size_t>> kinds;
    for (const std::string& name : names) {
      const std::string kind = without_number(name);
      if (kinds.empty() || kinds.back().first != kind) kinds.emplace_back(kind, 0);
      ++kinds.back().second;
    }
    std::string text;
    for (std::size_t i = 0; i < kinds.size() && i < kMaxNames; ++i)
      text += (i > 0 ? ", " : "") + kinds[i].first +
              (kinds[i].second > 1 ? " (" + grouped(kinds[i].second) + ")" : "");
    if (kinds.size() > kMaxNames) text += fmt::format(" and {} more", kinds.size() - kMaxNames);
    return text;
  }

  std::vector<BakeDifference> found_;
};

void compare_inputs(const BakeFile& a, const BakeFile& b, Differences& differences) {
  const auto inputs = [](const BakeFile& file) {
    std::map<std::string, std::string> named;
    for (const InputFile& input : file.provenance().inputs)
      named[input.name] = fmt::format("{} bytes, {:016x}", input.bytes, input.hash);
    return named;
  };
  auto in_a = inputs(a), in_b = inputs(b);
  std::set<std::string> names;
  for (const auto* side : {&in_a, &in_b})
    for (const auto& [name, text] : *side) names.insert(name);
  for (const std::string& name : names)
    differences.compare("input " + in_quotes(name), in_a[name], in_b[name]);
}

void compare_settings(const BakeSettings& a, const BakeSettings& b, Differences& differences) {
  differences.compare("seed", a.seed, b.seed);
  differences.compare("photons", a.photons, b.photons);
  differences.compare("most reflections", a.sources, b.sources);
  differences.compare("kappa", a.roulette_exponent, b.roulette_exponent);
  differences.compare("order of images", a.early_order, b.early_order);
  differences.compare("longest path, s", a.longest_path_s, b.longest_path_s);
  differences.compare("temperature, C", a.air.temperature_c, b.air.temperature_c);
  differences.compare("humidity, %", a.air.humidity_percent, b.air.humidity_percent);
  differences.compare("pressure, kPa", a.air.pressure_kpa, b.air.pressure_kpa);
}

// Hash of the contents of all pages, in the order of the trees, independent of how they are packed.
Result<std::uint64_t> hash_of_pages(const BakeFile& file) {
  static_assert(sizeof(Source) == 3 * sizeof(Vec3f) + sizeof(Bands) + 20);  // no bytes of padding
  std::vector<std::byte> bytes(sizeof(std::uint64_t));
  const auto read = file.for_each_page([&](const PageEntry& entry, const OctreePage& page,
                                           std::size_t tree, std::size_t depth) -> Result<void> {
    const std::array<std::uint64_t, 4> place = {tree, depth, entry.octant, entry.source_count};
    const auto head = std::as_bytes(std::span(place));
    bytes.insert(bytes.end(), head.begin(), head.end());
    for (const Source& source : page.sources) {
      const auto of_source = std::as_bytes(std::span(&source, 1));
      bytes.insert(bytes.end(), of_source.begin(), of_source.end());
      // Some bits of the last byte belong to no member. Pages hold no images.
      bytes.back() = std::byte{source.is_emitter};
    }
    for (const Instance& instance : page.links.instances) put_instance(instance, bytes);
    const std::uint64_t so_far = hash_of(bytes);
    bytes.resize(sizeof so_far);
    std::memcpy(bytes.data(), &so_far, sizeof so_far);
    return {};
  });
  if (!read.ok()) return read.error();
  return hash_of(bytes);
}

Result<bool> same_sources(const BakeFile& a, const BakeFile& b) {
  if (a.source_count() != b.source_count() || a.signal_maps() != b.signal_maps()) return false;
  const auto in_a = hash_of_pages(a), in_b = hash_of_pages(b);
  if (!in_a.ok()) return in_a.error();
  if (!in_b.ok()) return in_b.error();
  return *in_a == *in_b;
}

Result<bool> same_signals(const BakeFile& a, const BakeFile& b) {
  if (a.signal_count() != b.signal_count()) return false;
  for (std::size_t i = 0; i < a.signal_count(); ++i) {
    const auto in_a = a.read_signal(i), in_b = b.read_signal(i);
    if (!in_a.ok()) return in_a.error();
    if (!in_b.ok()) return in_b.error();
    if (in_a->samples != in_b->samples || in_a->loop != in_b->loop) return false;
  }
  return true;
}

// Compares triangles by position, whatever the order of their vertices.
bool same_surfaces(const Mesh& a, const Mesh& b) {
  if (a.materials != b.materials) return false;
  for (std::size_t t = 0; t < a.triangles.size(); ++t)
    for (std::size_t corner = 0; corner < 3; ++corner)
      if (a.vertices_m[a.triangles[t][corner]] != b.vertices_m[b.triangles[t][corner]])
        return false;
  return true;
}

std::vector<Emitter> emitters_in_world(const BakeFile& file) {
  std::vector<Emitter> emitters = file.emitters();
  for (Emitter& emitter : emitters) emitter.position_m += file.origin_m();
  return emitters;
}

std::vector<Portal> portals_in_world(const BakeFile& file) {
  std::vector<Portal> portals = file.portals().portals;
  for (Portal& portal : portals) portal.centre_m += file.origin_m();
  return portals;
}

// Names with numbers of triangles.
std::string movable_parts_of(const BakeFile& file) {
  std::vector<std::string> parts;
  for (const MovablePart& part : file.movable_parts())
    parts.push_back(fmt::format("{} ({})", part.name, part.mesh.triangles.size()));
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace

std::vector<BakeDifference> differences_of(const BakeFile& a, const BakeFile& b) {
  Differences differences;
  const auto version = [](const BakeFile& file) {
    return fmt::format("{}.{}", file.major(), file.minor());
  };
  const auto libraries = [](const BakeFile& file) {
    return fmt::format("{}", fmt::join(file.provenance().libraries, ", "));
  };
  differences.compare("format", version(a), version(b));
  differences.compare("tool", a.provenance().tool, b.provenance().tool);
  differences.compare("libraries", libraries(a), libraries(b));
  differences.compare("level", a.provenance().level, b.provenance().level);
  compare_inputs(a, b, differences);
  compare_settings(a.settings(), b.settings(), differences);
  differences.compare("origin", place_of(a.origin_m()), place_of(b.origin_m()));
  differences.compare_named("emitter", emitters_in_world(a), emitters_in_world(b));
  differences.compare_named("portal", portals_in_world(a), portals_in_world(b));
  differences.compare_named("material", a.materials(), b.materials());
  differences.compare("movable parts", movable_parts_of(a), movable_parts_of(b));
  differences.compare("sources", a.source_count(), b.source_count());
  differences.compare("bytes", a.bytes().file, b.bytes().file);
  differences.compare("photons escaped", a.statistics().photons_escaped,
                      b.statistics().photons_escaped);
  differences.compare("T30, s", bands_of(a.statistics().decay.t30_s, "{:.3f}"),
                      bands_of(b.statistics().decay.t30_s, "{:.3f}"));
  return differences.take();
}

std::array<double, kBandCount> level_difference_db(const Bands& a, const Bands& b) {
  std::array<double, kBandCount> difference{};
  for (std::size_t band = 0; band < kBandCount; ++band)
    if (a[band] > 0 && b[band] > 0)
      difference[band] =
          10 * std::log10(static_cast<double>(b[band]) / static_cast<double>(a[band]));
  return difference;
}

bool is_same_scene(const BakeFile& a, const BakeFile& b) {
  return a.settings().air == b.settings().air && a.materials() == b.materials() &&
         a.emitters() == b.emitters() && a.movable_parts() == b.movable_parts() &&
         a.portals() == b.portals();
}

Result<bool> sound_identical(const BakeFile& a, const BakeFile& b) {
  if (!is_same_scene(a, b)) return false;
  const auto sources = same_sources(a, b);
  if (!sources.ok() || !*sources) return sources;
  const auto signals = same_signals(a, b);
  if (!signals.ok() || !*signals) return signals;
  const auto in_a = a.read_mesh(), in_b = b.read_mesh();
  if (!in_a.ok()) return in_a.error();
  if (!in_b.ok()) return in_b.error();
  return same_surfaces(*in_a, *in_b);
}

}  // namespace clamor
