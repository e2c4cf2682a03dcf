// experiment_probes.cpp: how near reflections through probes come to those of a bake of the place.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <ostream>
#include <tuple>

#include <fmt/format.h>

#include "bake/bake.h"
#include "common/decay_curve.h"
#include "common/random.h"
#include "common/reflection.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/first_leg.h"
#include "formats/bake_file/page.h"
#include "formats/level/level.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/probes/first_reflection_tracer.h"
#include "runtime/probes/probe_neighbours.h"
#include "runtime/probes/probe_sources.h"
#include "runtime/propagation/received_intensity.h"
#include "runtime/response/energy_response.h"
#include "tools/analysis/room_parameters.h"
#include "tools/experiments/experiments.h"

namespace clamor {

namespace {

constexpr std::size_t kFirstBand = 1, kLastBand = 6;  // 125 Hz to 4 kHz
constexpr std::uint64_t kTruthSources = 400'000, kTruthPhotons = 1'000'000;
constexpr std::size_t kPlacesPerSeed = 4;
constexpr double kCurveEnd_db = 40;
constexpr double kEarly_s = 0.08;  // as in C80
// Distance from surfaces: of microphones as ISO 3382-1 wants it. Next to a wall, the few sources on
// a small piece of it make up much of what is heard, in whatever bake.
constexpr double kSourceClearance_m = 0.5, kEarClearance_m = 1;

// A source and a listener, neither of them at a probe.
struct Place {
  Vec3 source_m{}, listener_m{};
};

struct PlaceResponse {
  std::array<std::vector<EnergyStep>, kBandCount> steps;  // from the direct sound on
  RoomParameters parameters;
  Bands reflected{}, early{};  // early: of the reflected, the first 80 ms
};

using Values = std::array<std::optional<double>, kBandCount>;

// How a parameter of two responses differs, and by how much it may.
struct DifferenceKind {
  const char* name;  // in the table of all places; none if it is not judged
  double bar;
  const char* column;  // in the table of each place; none if it is not there
};
constexpr std::array<DifferenceKind, 7> kKinds = {{{"decay curve, first 40 dB, dB", 1, nullptr},
                                                   {"T30, %", 5, "t30_percent"},
                                                   {"EDT, %", 5, "edt_percent"},
                                                   {"C80, dB", 1, "c80_db"},
                                                   {"direct to reverberant, dB", 1, "drr_db"},
                                                   {nullptr, 0, "early_db"},
                                                   {nullptr, 0, "late_db"}}};

// The differences of one response to another, of each kind and per band; missing where the other
// has no such value.
using PlaceDifference = std::array<Values, kKinds.size()>;

std::vector<Material> with_late_reflections(std::vector<Material> materials) {
  materials.push_back(late_reflection_material());
  return materials;
}

class ProbeTruth {
 public:
  ProbeTruth(const BakeFile& file, const Mesh& mesh)
      : file_(file),
        laws_(with_late_reflections(file.materials())),
        loss_per_m_(air_loss_per_m(file.settings().air)),
        surfaces_(mesh, file.materials()),
        neighbours_(places(), &surfaces_, 1),
        tracer_(surfaces_, file.materials(), file.settings().air, {}) {
    level_.mesh = mesh;
    level_.materials = file.materials();
    level_.air = file.settings().air;
    level_.signals = {{"impulse", {1}, false}};
  }

  std::vector<Vec3> places() const {
    std::vector<Vec3> places_m;
    for (const StoredProbe& probe : file_.probes().places) places_m.push_back(probe.position_m);
    return places_m;
  }
  const OcclusionGeometry& surfaces() const { return surfaces_; }

  // Through a bake with an emitter at the very place.
  Result<PlaceResponse> baked(const Place& place, std::uint64_t seed) const {
    Level level = level_;
    level.emitters = {emitter_at(place.source_m)};
    BakeOptions options;
    options.settings = file_.settings();
    options.settings.photons = kTruthPhotons;
    options.settings.sources = kTruthSources;
    options.settings.seed = seed;
    options.settings.early_order = 0;  // moving sources have no image sources
    auto contents = bake(level, options);
    if (!contents.ok()) return contents.error();
    return response(contents->octree.sources, place);
  }

  Result<PlaceResponse> through_probes(const Place& place) {
    neighbours_.begin();
    const auto weights = neighbours_.weights(0, ++generation_, place.source_m);
    Result<void> wrong;
    const auto sources_of = [&](const StoredTree& tree) -> std::span<const Source> {
      const auto [at, is_new] = stored_.try_emplace(tree.top.page.offset);
      if (is_new) {
        auto read = read_tree(tree.top);
        if (read.ok())
          at->second = std::move(*read);
        else
          wrong = read.error();
      }
      return at->second;
    };
    MovingRadiator radiator;
    radiator.position_m = place.source_m;
    std::vector<Source> sources;
    const auto add = [&](Source source, float weight) {
      source.emitter = 0;
      for (float& band : source.power) band *= weight;
      sources.push_back(source);
    };
    const auto late_material = static_cast<std::uint16_t>(file_.materials().size());
    for (const ProbeWeight& weight : weights) {
      const StoredProbe& probe = file_.probes().places[weight.probe];
      for (const Source& stored : sources_of(probe.tree))
        add(early_reflection(stored, probe.position_m, radiator, speed_of_sound_mps(level_.air)),
            weight.weight);
      for (const Source& stored : sources_of(file_.probes().zones[probe.zone]))
        add(late_reflection(stored, radiator, late_material), weight.weight);
    }
    if (!wrong.ok()) return wrong.error();
    std::vector<FirstReflection> first;
    for (std::uint32_t set = 0; set < FirstReflectionTracer::kSets; ++set)
      tracer_.trace(place.source_m, place.listener_m, generation_, set, first);
    for (const FirstReflection& reflection : first) sources.push_back(reflection.source);
    Source direct;
    set_from_emitter(direct, emitter_at(place.source_m));
    sources.push_back(direct);
    return response(sources, place);
  }

 private:
  static Emitter emitter_at(const Vec3& place_m) {
    Emitter emitter;
    emitter.name = "source";
    emitter.position_m = place_m;
    return emitter;
  }

  // All sources with open portals.
  Result<std::vector<Source>> read_tree(const PageEntry& top) const {
    std::vector<Source> sources;
    const std::vector<float> openness = openness_by_set(file_.portals(), {});
    const auto add = [&](const PageEntry&, const OctreePage& page, std::size_t,
                         std::size_t) -> Result<void> {
      for (const Source& source : page.sources) {
        const std::uint32_t set = source.path.portal_set;
        if (set >= openness.size() || openness[set] > 0) sources.push_back(source);
      }
      return {};
    };
    if (const auto read = file_.for_each_page({top}, add); !read.ok()) return read.error();
    return sources;
  }

  // From the sources that the listener sees. Diffraction, which costs a hundred times as much, is
  // the same for all responses that are compared.
  PlaceResponse response(std::span<const Source> sources, const Place& place) const {
    PlaceResponse result;
    std::vector<Arrival> arrivals;
    const Vec3& listener_m = place.listener_m;
    const double speed_mps = speed_of_sound_mps(level_.air);
    // All responses of a place count from the time that direct sound takes.
    const double start_s = length(listener_m - place.source_m) / speed_mps;
    for (const Source& source : sources) {
      const Bands energy = received_intensity(source, emitters_, laws_, loss_per_m_, listener_m);
      if (energy == Bands{}) continue;
      const auto origin_m = surfaces_.ray_origin(source);
      if (!origin_m || !surfaces_.is_free(*origin_m, Vec3f(listener_m))) continue;
      const double r_m = length(listener_m - Vec3(source.position_m));
      const double time_s = static_cast<double>(source.delay_s) + r_m / speed_mps;
      arrivals.push_back({time_s, energy, 1});
      for (std::size_t b = 0; b < kBandCount && !source.is_emitter; ++b) {
        result.reflected[b] += energy[b];
        if (time_s - start_s < kEarly_s) result.early[b] += energy[b];
      }
    }
    std::ranges::stable_sort(arrivals, {}, &Arrival::time_s);
    result.parameters = room_parameters(arrivals, free_field_energy_at_10m(emitters_[0]));
    for (const Arrival& arrival : arrivals)
      for (std::size_t b = 0; b < kBandCount; ++b)
        if (arrival.energy[b] > 0)
          result.steps[b].push_back({arrival.time_s - start_s, arrival.energy[b]});
    return result;
  }

  const BakeFile& file_;
  Level level_;
  const std::vector<Emitter> emitters_{1};  // omnidirectional
  const ReflectionLaws laws_;
  const Bands loss_per_m_;
  OcclusionGeometry surfaces_;
  ProbeNeighbours neighbours_;
  const FirstReflectionTracer tracer_;
  std::uint32_t generation_ = 0;
  std::map<std::uint64_t, std::vector<Source>> stored_;  // by the offset of a tree's top
};

// Greatest difference of the decay curves while the first falls by 40 dB, in dB.
std::optional<double> curve_difference(std::span<const EnergyStep> truth,
                                       std::span<const EnergyStep> other) {
  if (truth.empty() || other.empty()) return std::nullopt;
  constexpr std::size_t kTimes = 4000;  // 5 ms apart
  // Energy that arrives after each of the times.
  const auto energy_after = [](std::span<const EnergyStep> steps) {
    std::vector<double> after(kTimes);
    double sum = 0;
    std::size_t s = steps.size();
    for (std::size_t t = kTimes; t-- > 0; after[t] = sum)
      while (s > 0 && steps[s - 1].time_s >= 0.005 * static_cast<double>(t))
        sum += steps[--s].energy;
    return after;
  };
  const auto a = energy_after(truth), b = energy_after(other);
  double worst = 0;
  for (std::size_t t = 0; t < kTimes && a[t] >= a[0] * std::pow(10, -kCurveEnd_db / 10); ++t) {
    const double difference = 10 * std::log10(std::max(b[t], 1e-30) / a[t]);
    if (std::abs(difference) > std::abs(worst)) worst = difference;
  }
  return worst;
}

PlaceDifference difference(const PlaceResponse& truth, const PlaceResponse& other) {
  PlaceDifference result;
  const auto percent = [](const std::optional<double>& a, const std::optional<double>& b) {
    return a && b ? std::optional(100 * (*b / *a - 1)) : std::nullopt;
  };
  const auto decibels = [](double a, double b) {
    return a > 0 && b > 0 ? std::optional(10 * std::log10(b / a)) : std::nullopt;
  };
  const RoomParameters &a = truth.parameters, &o = other.parameters;
  for (std::size_t b = kFirstBand; b <= kLastBand; ++b) {
    const std::array<std::optional<double>, kKinds.size()> values = {
        curve_difference(truth.steps[b], other.steps[b]),
        percent(a.t30_s[b], o.t30_s[b]),
        percent(a.edt_s[b], o.edt_s[b]),
        a.c80_db[b] && o.c80_db[b] ? std::optional(*o.c80_db[b] - *a.c80_db[b]) : std::nullopt,
        decibels(other.reflected[b], truth.reflected[b]),
        decibels(truth.early[b], other.early[b]),
        decibels(truth.reflected[b] - truth.early[b], other.reflected[b] - other.early[b])};
    for (std::size_t kind = 0; kind < kKinds.size(); ++kind) result[kind][b] = values[kind];
  }
  return result;
}

// Places between probes that see each other, off by up to half a metre. They do not depend on the
// order of the probes.
std::vector<Place> draw_places(const ProbeTruth& truth, std::size_t count) {
  std::vector<Vec3> probes_m = truth.places();
  std::ranges::sort(probes_m, {}, [](const Vec3& at) { return std::tuple(at.x, at.y, at.z); });
  std::uint32_t draws = 0;
  const auto random = [&] { return unit(philox(0x706c6163, {draws++, 0, 0, 0})[0]); };
  const auto any_probe = [&] {
    return probes_m[std::min(
        static_cast<std::size_t>(random() * static_cast<double>(probes_m.size())),
        probes_m.size() - 1)];
  };
  const auto air_place = [&](double clearance_m) -> std::optional<Vec3> {
    const Vec3 from_m = any_probe(), to_m = any_probe();
    if (!truth.surfaces().is_free(Vec3f(from_m), Vec3f(to_m))) return std::nullopt;
    const double share = std::min(1.0, 4 / std::max(length(to_m - from_m), 1e-3)) * random();
    const Vec3 place_m = from_m + share * (to_m - from_m) +
                         Vec3(random() - 0.5, 0.4 * (random() - 0.5), random() - 0.5);
    if (!truth.surfaces().is_free(Vec3f(from_m), Vec3f(place_m)) ||
        !is_clear(truth.surfaces(), place_m, clearance_m))
      return std::nullopt;
    return place_m;
  };
  std::vector<Place> places;
  while (places.size() < count && draws < 1'000'000) {
    const auto source_m = air_place(kSourceClearance_m), listener_m = air_place(kEarClearance_m);
    if (!source_m || !listener_m || length(*source_m - *listener_m) < 1) continue;
    // The direct sound must arrive: without it the parameters have no origin.
    if (!truth.surfaces().is_free(Vec3f(*source_m), Vec3f(*listener_m))) continue;
    places.push_back({*source_m, *listener_m});
  }
  return places;
}

// The mean, the spread, and the greatest of each kind of difference, and the share within its bar.
void add_rows(ReportTable& table, const std::string& of,
              std::span<const PlaceDifference> differences) {
  for (std::size_t kind = 0; kind < kKinds.size(); ++kind) {
    const auto& [name, bar, column] = kKinds[kind];
    double n = 0, sum = 0, squares = 0, most = 0, within = 0;
    for (const PlaceDifference& one : differences)
      for (const auto& value : one[kind]) {
        if (!value) continue;
        ++n, sum += *value, squares += *value * *value;
        most = std::max(most, std::abs(*value));
        within += std::abs(*value) <= bar ? 1 : 0;
      }
    if (name != nullptr && n > 0)
      table.rows.push_back(
          {name, of, sum / n, std::sqrt(squares / n), most, bar, 100 * within / n});
  }
}

// The mean over the bands that have a value; an empty cell if none has.
ReportTable::Cell mean(const Values& values) {
  double sum = 0;
  int count = 0;
  for (const auto& value : values)
    if (value) sum += *value, ++count;
  if (count == 0) return std::string();
  return sum / count;
}

ReportTable table_of_places(std::span<const Place> places,
                            std::span<const PlaceDifference> differences) {
  ReportTable table{
      "places",
      "The differences at each place, mean of 125 Hz to 4 kHz; early and late "
      "reflections are those before and after 80 ms",
      {"source_x_m", "source_y_m", "source_z_m", "listener_x_m", "listener_y_m", "listener_z_m"},
      {}};
  for (const DifferenceKind& kind : kKinds)
    if (kind.column != nullptr) table.columns.emplace_back(kind.column);
  for (std::size_t p = 0; p < places.size(); ++p) {
    auto& row = table.rows.emplace_back();
    for (const Vec3& at_m : {places[p].source_m, places[p].listener_m})
      for (const double coordinate_m : {at_m.x, at_m.y, at_m.z}) row.emplace_back(coordinate_m);
    for (std::size_t kind = 0; kind < kKinds.size(); ++kind)
      if (kKinds[kind].column != nullptr) row.push_back(mean(differences[p][kind]));
  }
  return table;
}

}  // namespace

Result<ReportPage> probes_experiment(const ExperimentOptions& options, std::ostream& err) {
  auto file = BakeFile::open(options.level);
  if (!file.ok()) return file.error();
  if (file->probes().places.empty())
    return Error(options.level + ": it has no probes; bake with --probes auto");
  const auto mesh = file->read_mesh();
  if (!mesh.ok()) return mesh.error();
  ProbeTruth truth(*file, *mesh);
  const std::size_t count = options.quick ? 2 : static_cast<std::size_t>(options.readings);
  const std::vector<Place> places = draw_places(truth, count);
  if (places.empty())
    return Error(options.level +
                 ": its rooms are too small; no place for a listener is a metre from all surfaces");
  std::vector<PlaceDifference> by_probes, by_seed;
  for (const Place& place : places) {
    const auto exact = truth.baked(place, 1);
    const auto heard = truth.through_probes(place);
    if (!exact.ok()) return exact.error();
    if (!heard.ok()) return heard.error();
    // A few places tell how well the truth itself is known.
    if (by_probes.size() % kPlacesPerSeed == 0) {
      const auto again = truth.baked(place, 2);
      if (!again.ok()) return again.error();
      by_seed.push_back(difference(*exact, *again));
    }
    by_probes.push_back(difference(*exact, *heard));
    err << fmt::format("  place {} of {}\n", by_probes.size(), places.size());
  }
  ReportTable table{"probes",
                    "Differences from a bake with an emitter at the place, 125 Hz to 4 kHz",
                    {"parameter", "of", "mean", "rms", "greatest", "bar", "within_bar_percent"},
                    {}};
  add_rows(table, "probes", by_probes);
  add_rows(table, "another seed", by_seed);
  ReportPage page("probes", "Reflections through probes",
                  fmt::format("{}: {} probes, {} places", options.level,
                              file->probes().places.size(), places.size()));
  page.table(table);
  page.table(table_of_places(places, by_probes));
  return page;
}

}  // namespace clamor
