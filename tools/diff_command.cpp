// diff_command.cpp: clamor diff: in what two bake files differ.
#include <algorithm>
#include <cmath>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <nlohmann/json.hpp>

#include "formats/bake_file.h"
#include "tools/arguments.h"
#include "tools/commands.h"

namespace clamor {

namespace {

struct Difference {
  std::string what, a, b;  // "" where a file has none
};

class Differences {
 public:
  template <class Value>
  void compare(const std::string& what, const Value& a, const Value& b) {
    if (!(a == b)) found_.push_back({what, fmt::format("{}", a), fmt::format("{}", b)});
  }
  void add(Difference difference) { found_.push_back(std::move(difference)); }
  const std::vector<Difference>& found() const { return found_; }

 private:
  std::vector<Difference> found_;
};

std::string bands_of(const Bands& bands, const char* format) {
  std::string text;
  for (const float value : bands)
    text += (text.empty() ? "" : " ") + fmt::format(fmt::runtime(format), value);
  return text;
}

std::string described(const Emitter& emitter) {
  return fmt::format(
      "at {:.3f},{:.3f},{:.3f} facing {:.2f},{:.2f},{:.2f} gain {:.3f} directivity "
      "{} signal {} starts {:.3f} s",
      emitter.position_m.x, emitter.position_m.y, emitter.position_m.z, emitter.axis.x,
      emitter.axis.y, emitter.axis.z, emitter.gain, bands_of(emitter.directivity, "{:.2g}"),
      emitter.signal, emitter.delay_s);
}

std::string described(const Material& material) {
  return fmt::format("absorbs {} scatters {} phong {} lets through {}",
                     bands_of(material.absorption, "{:.2f}"),
                     bands_of(material.scattering, "{:.2f}"), bands_of(material.phong, "{:.3g}"),
                     bands_of(material.transmission, "{:.2f}"));
}

// By name; of namesakes the first with the first, and so on.
template <class Thing>
std::map<std::pair<std::string, std::size_t>, std::string> by_name(const std::vector<Thing>& all) {
  std::map<std::pair<std::string, std::size_t>, std::string> named;
  std::map<std::string, std::size_t> namesakes;
  for (const Thing& thing : all) named[{thing.name, namesakes[thing.name]++}] = described(thing);
  return named;
}

template <class Thing>
void compare_named(const std::string& kind, const std::vector<Thing>& a,
                   const std::vector<Thing>& b, Differences& differences) {
  const auto in_a = by_name(a), in_b = by_name(b);
  const auto title = [&](const auto& key) {
    return kind + " " + in_quotes(key.first) +
           (key.second > 0 ? " #" + std::to_string(key.second + 1) : "");
  };
  for (const auto& [key, text] : in_a) {
    const auto other = in_b.find(key);
    if (other == in_b.end())
      differences.add({title(key), text, ""});
    else if (other->second != text)
      differences.add({title(key), text, other->second});
  }
  for (const auto& [key, text] : in_b)
    if (!in_a.contains(key)) differences.add({title(key), "", text});
}

// How much louder all of B's sources are than A's, per band.
Bands level_difference_db(const BakeFile& a, const BakeFile& b) {
  Bands difference{};
  if (a.top() == nullptr || b.top() == nullptr) return difference;
  for (std::size_t band = 0; band < kBandCount; ++band) {
    const double in_a = a.top()->power[band], in_b = b.top()->power[band];
    if (in_a > 0 && in_b > 0) difference[band] = static_cast<float>(10 * std::log10(in_b / in_a));
  }
  return difference;
}

Differences differences_of(const BakeFile& a, const BakeFile& b) {
  Differences differences;
  const auto compare = [&](const char* what, const auto& in_a, const auto& in_b) {
    differences.compare(what, in_a, in_b);
  };
  compare("format", fmt::format("{}.{}", a.major(), a.minor()),
          fmt::format("{}.{}", b.major(), b.minor()));
  compare("tool", a.provenance().tool, b.provenance().tool);
  compare("libraries", fmt::format("{}", fmt::join(a.provenance().libraries, ", ")),
          fmt::format("{}", fmt::join(b.provenance().libraries, ", ")));
  compare("level", a.provenance().level, b.provenance().level);
  const auto inputs = [](const BakeFile& file) {
    std::map<std::string, std::string> named;
    for (const InputFile& input : file.provenance().inputs)
      named[input.name] = fmt::format("{} bytes, {:016x}", input.bytes, input.hash);
    return named;
  };
  const auto in_a = inputs(a), in_b = inputs(b);
  for (const auto& [name, text] : in_a) {
    const auto other = in_b.find(name);
    if (other == in_b.end() || other->second != text)
      differences.add({"input " + in_quotes(name), text, other == in_b.end() ? "" : other->second});
  }
  for (const auto& [name, text] : in_b)
    if (!in_a.contains(name)) differences.add({"input " + in_quotes(name), "", text});

  const BakeSettings &sa = a.settings(), &sb = b.settings();
  compare("seed", sa.seed, sb.seed);
  compare("photons", sa.photons, sb.photons);
  compare("most reflections", sa.sources, sb.sources);
  compare("kappa", sa.roulette_kappa, sb.roulette_kappa);
  compare("longest path, s", sa.longest_path_s, sb.longest_path_s);
  compare("temperature, C", sa.air.temperature_c, sb.air.temperature_c);
  compare("humidity, %", sa.air.humidity_percent, sb.air.humidity_percent);
  compare("pressure, kPa", sa.air.pressure_kpa, sb.air.pressure_kpa);
  compare_named("material", a.materials(), b.materials(), differences);
  compare_named("emitter", a.emitters(), b.emitters(), differences);

  compare("sources", a.source_count(), b.source_count());
  compare("bytes", a.bytes().file, b.bytes().file);
  compare("photons escaped", a.statistics().photons_escaped, b.statistics().photons_escaped);
  compare("T30, s", bands_of(a.statistics().decay.t30_s, "{:.3f}"),
          bands_of(b.statistics().decay.t30_s, "{:.3f}"));
  return differences;
}

}  // namespace

int run_diff(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string path_a, path_b;
  bool json = false;
  Arguments parser("diff",
                   "Prints in what two bake files differ: how they were made, materials, emitters, "
                   "sources, and how much louder B is per band. Exit code 0 when both can be read, "
                   "alike or not.",
                   "clamor diff before.clamor after.clamor");
  parser.positional("a", path_a, "a bake file");
  parser.positional("b", path_b, "another");
  parser.flag("--json", json,
              "alike, differences (what, a, b) and level_db per band, for programs");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto a = BakeFile::open(path_a), b = BakeFile::open(path_b);
  for (const auto* file : {&a, &b})
    if (!file->ok()) {
      fmt::print(err, "clamor diff: {}\n", file->error().message);
      return kBadInput;
    }
  const Differences differences = differences_of(*a, *b);
  const Bands level_db = level_difference_db(*a, *b);
  const bool louder = std::any_of(level_db.begin(), level_db.end(),
                                  [](float db) { return std::abs(db) >= 0.005f; });
  const bool alike = differences.found().empty() && !louder;
  if (json) {
    using Json = nlohmann::ordered_json;
    Json rows = Json::array();
    for (const auto& [what, in_a, in_b] : differences.found())
      rows.push_back({{"what", what}, {"a", in_a}, {"b", in_b}});
    const Json whole = {{"alike", alike}, {"differences", rows}, {"level_db", level_db}};
    out << whole.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    return kSuccess;
  }
  fmt::print(out, "A {}\nB {}\n", path_a, path_b);
  if (alike) fmt::print(out, "alike in all that a bake file tells of itself\n");
  const auto shown = [](const std::string& text) {
    std::string line = text.empty() ? "-" : text;
    for (char& c : line)
      if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
    return line;
  };
  constexpr std::size_t kMostRows = 60;
  for (std::size_t i = 0; i < std::min(kMostRows, differences.found().size()); ++i) {
    const auto& [what, in_a, in_b] = differences.found()[i];
    if (in_a.size() + in_b.size() < 60)
      fmt::print(out, "  {:<24} {:<22} {}\n", shown(what), shown(in_a), shown(in_b));
    else
      fmt::print(out, "  {}\n    A {}\n    B {}\n", shown(what), shown(in_a), shown(in_b));
  }
  if (differences.found().size() > kMostRows)
    fmt::print(out, "  ... and {} more (--json has all)\n", differences.found().size() - kMostRows);
  if (louder) fmt::print(out, "  {:<24} {}\n", "B louder by, dB", bands_of(level_db, "{:+.2f}"));
  return kSuccess;
}

}  // namespace clamor
