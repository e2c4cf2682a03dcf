#include "bake/probe_tracing.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "bake/octree/octree_builder.h"
#include "bake/octree/patch_radius.h"
#include "bake/probes/diffuse_late_field.h"
#include "bake/trace/pilot.h"
#include "formats/bake_file/first_leg.h"
#include "formats/bake_file/source_quantization.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

// A zone keeps as many late sources as its probes keep early ones, counting at least 16 probes and
// at most 32. A doorway is a zone of its own, with one or two probes. With at least 8 probes, the
// error of T30 is 5.1 % rms instead of 4.0 in the violin room and 6.5 instead of 6.2 in Sponza. A
// stadium has 200 zones and would exceed 20 MB: where there are more than kSharesInAll allows for,
// the zones keep fewer.
constexpr std::size_t kLeastZoneShares = 4, kMostZoneShares = 16, kSharesInAll = 900;
// Photons whose early reflections a probe takes, in whole runs. With a quarter, the error of EDT
// between probes is 6.0 % rms instead of 4.8 % in the violin room, and that of C80 0.59 dB instead
// of 0.46; half as many sources of as many photons lose less, 5.3 % and 0.48 dB.
constexpr std::uint64_t kEarlyPhotons = 4 * kRunPhotons;
// Reflections that the photons of all probes of a zone leave together, at least.
constexpr double kZoneReflections = 800'000;
// A deposit whose path is longer than the first leg by more than this is not on the first surface.
constexpr double kSameLength_m = 2e-3;
// Deposits per source that the tracer leaves, and the collector thins.
constexpr double kLateDepositsPerSource = 0.75;

// Selects the random numbers of a probe, whatever the other probes are.
std::string name_of(const Vec3& place_m) {
  std::string name = "probe";
  for (int axis = 0; axis < 3; ++axis)
    name += " " + std::to_string(std::llround(1000 * place_m[axis]));
  return name;
}

// The tree of a probe that no surface reflects.
SourceOctree empty_tree(const Vec3& place_m) {
  SourceOctree tree;
  OctreeNode& top = tree.nodes.emplace_back();
  top.low_m = top.high_m = Vec3f(place_m);
  return tree;
}

std::uint32_t zone_sources(std::uint32_t places, std::size_t zones,
                           std::uint32_t sources_per_probe) {
  const auto least = static_cast<std::uint32_t>(std::clamp(
      kSharesInAll / std::max<std::size_t>(zones, 1), kLeastZoneShares, kMostZoneShares));
  return std::clamp(places, least, 2 * least) * sources_per_probe;
}

}  // namespace

Level level_of_probes(const Level& level, std::span<const Vec3> places_m, const ProbeZones& zones) {
  Level probes;
  probes.name = level.name;
  probes.materials = level.materials;
  probes.air = level.air;
  probes.portals = level.portals;
  for (const std::uint32_t place : zones.order) {
    Emitter& emitter = probes.emitters.emplace_back();
    emitter.name = name_of(places_m[place]);
    emitter.position_m = places_m[place];
  }
  return probes;
}

ProbePlan plan_probes(const Scene& scene, const Level& level, const ProbeZones& zones,
                      std::uint32_t sources_per_probe, std::uint64_t level_photons,
                      TraceSettings trace) {
  trace.images = nullptr;  // those are of the level's emitters
  ProbePlan plan;
  const std::uint64_t early_photons =
      kEarlyPhotons * std::max<std::uint64_t>(1, sources_per_probe / kProbeSources);
  plan.trace = trace;
  const Pilot pilot = trace_pilot(scene, level, trace);
  const double zone_photons = kZoneReflections / std::max(1.0, pilot.deposits_per_photon());
  std::uint64_t late_sources = 0;
  for (const std::uint32_t size : zones.sizes) {
    const std::uint64_t wanted =
        std::max(early_photons, static_cast<std::uint64_t>(zone_photons) / size);
    // A bake that is asked for few photons has few for each probe, too.
    const std::uint64_t of_each = std::min(wanted, std::max<std::uint64_t>(level_photons, 1));
    plan.photons.photons.insert(plan.photons.photons.end(), size, scene.is_empty() ? 0 : of_each);
    late_sources += zone_sources(size, zones.sizes.size(), sources_per_probe);
  }
  const auto photons = static_cast<double>(plan.photons.all_photons());
  plan.trace.decay = pilot.decay;
  plan.trace.early_until_m = zones.late_from_m;
  plan.trace.early_photons = early_photons;
  plan.trace.deposit_threshold = pilot.threshold(
      photons, kLateDepositsPerSource * static_cast<double>(late_sources), zones.late_from_m);
  return plan;
}

ProbeCollector::ProbeCollector(const Scene& scene, const Level& level, const ProbeZones& zones,
                               const PhotonTracer& tracer, const BakePlan& plan,
                               std::uint32_t sources_per_probe, PortalSetTable& portals)
    : scene_(scene),
      level_(level),
      zones_(zones),
      tracer_(tracer),
      plan_(plan),
      sources_per_probe_(sources_per_probe),
      portals_(portals),
      laws_(level.materials) {
  begin_place();
  begin_zone();
}

bool ProbeCollector::is_first_reflection(const Deposit& deposit) const {
  const double path_m = static_cast<double>(deposit.delay_s) * tracer_.speed_mps();
  return path_m - static_cast<double>(hits_[deposit.photon].distance_m) < kSameLength_m;
}

std::uint32_t ProbeCollector::first_leg(const Deposit& deposit) const {
  return first_leg_code({rays_[deposit.photon].direction, hits_[deposit.photon].distance_m});
}

void ProbeCollector::add(const TracedRun& run, std::span<const Deposit> deposits) {
  while (finished_.places.size() < run.run.emitter) finish_place();
  tracer_.first_rays(run.run, rays_);
  hits_.resize(rays_.size());
  scene_.first_hits(rays_, hits_);
  const std::size_t zone = finished_.zones.size();
  const auto late_from_s =
      static_cast<float>(tracer_.settings().early_until_m / tracer_.speed_mps());
  const std::uint64_t photons = plan_.photons[run.run.emitter];
  // The first photons of a sequence cover all directions evenly, which thinning would undo. They
  // are whole runs.
  const double early_share =
      1 / static_cast<double>(std::min(photons, tracer_.settings().early_photons));
  const double late_share = 1 / (static_cast<double>(photons) * zones_.sizes[zone]);
  early_sources_.clear();
  late_sources_.clear();
  for (const Deposit& deposit : deposits) {
    if (is_first_reflection(deposit)) continue;
    const bool is_late = deposit.delay_s >= late_from_s;
    auto& sources = is_late ? late_sources_ : early_sources_;
    sources.push_back(secondary_source(deposit, is_late ? late_share : early_share));
    ProbePortalSets& sets = is_late ? late_sets_ : early_sets_;
    sources.back().path = sets.path_of(first_leg(deposit), deposit.portals);
  }
  early_->add(early_sources_);
  late_->add(late_sources_, tracer_.deposit_threshold(run.run.emitter) * late_share);
}

void ProbeCollector::begin_place() { early_.emplace(sources_per_probe_); }

void ProbeCollector::begin_zone() {
  const std::size_t zone = finished_.zones.size();
  if (zone < zones_.sizes.size())
    late_.emplace(zone_sources(zones_.sizes[zone], zones_.sizes.size(), sources_per_probe_),
                  DepositWeight(tracer_.settings().decay), tracer_.speed_mps());
}

std::vector<Source> ProbeCollector::completed(std::vector<Source> sources,
                                              ProbePortalSets& sets) const {
  sets.finish(sources, portals_);
  set_patch_radii(sources);
  return sources;
}

void ProbeCollector::finish_place() {
  finished_.places.push_back(completed(early_->take().take_vector(), early_sets_));
  begin_place();
  if (++places_in_zone_ < zones_.sizes[finished_.zones.size()]) return;
  places_in_zone_ = 0;
  std::vector<Source> late = late_->take().take_vector();
  make_diffuse(late, scene_, laws_);
  finished_.zones.push_back(completed(std::move(late), late_sets_));
  begin_zone();
}

ProbeSources ProbeCollector::take() {
  while (finished_.places.size() < level_.emitters.size()) finish_place();
  return std::exchange(finished_, {});
}

BakedProbes build_probes(const Level& level, const ProbeZones& zones,
                         std::vector<ProbeSources> states) {
  BakedProbes probes;
  if (states.empty()) return probes;
  const auto tree_of = [&](std::vector<std::vector<Source>> ProbeSources::*trees, std::size_t tree,
                           const Vec3& place_m) {
    std::vector<Source> sources;
    for (ProbeSources& state : states) {
      const std::vector<Source> more = std::exchange((state.*trees)[tree], {});
      sources.insert(sources.end(), more.begin(), more.end());
    }
    quantize_sources(sources, level.materials);
    return sources.empty() ? empty_tree(place_m) : build_octree(std::move(sources));
  };
  std::size_t place = 0;
  for (std::uint32_t zone = 0; zone < zones.sizes.size(); ++zone) {
    Vec3 last_m{};
    for (std::uint32_t of_zone = 0; of_zone < zones.sizes[zone]; ++of_zone, ++place) {
      last_m = level.emitters[place].position_m;
      probes.places.push_back({last_m, tree_of(&ProbeSources::places, place, last_m), zone});
    }
    probes.zones.push_back(tree_of(&ProbeSources::zones, zone, last_m));
  }
  return probes;
}

}  // namespace clamor
