#include "runtime/probes/first_reflections.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <utility>

#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/probes/probe_neighbours.h"
#include "runtime/propagation/tolerances.h"

namespace clamor {

namespace {

using namespace first_reflections;
constexpr std::size_t kSetsPerKeyframe =
    kReflectionRaysPerKeyframe / FirstReflectionTracer::kRaysOfSet;

std::uint64_t key_of(std::uint32_t source, std::uint32_t generation) {
  return std::uint64_t{source} << 32 | generation;
}

}  // namespace

FirstReflections::FirstReflections(const OcclusionGeometry& surfaces, FirstReflectionTracer tracer,
                                   const ProbeBounds& bounds, std::size_t sources, bool with_images)
    : surfaces_(surfaces),
      tracer_(std::move(tracer)),
      bounds_(bounds),
      with_images_(with_images),
      states_(sources) {}

void FirstReflections::begin(const Vec3& listener_m) {
  listener_m_ = listener_m;
  active_.clear();
  is_settled_ = true;
  ++keyframe_;
  rays_left_ = kReflectionRaysPerKeyframe;
  parts_version_ = surfaces_.parts_version();
}

void FirstReflections::add(std::size_t source, std::uint32_t generation, const Vec3& place_m,
                           float factor, const Bands& band_shares) {
  const double r_m = std::max(length(place_m - listener_m_), kNearest_m);
  const Active& active =
      active_.emplace_back(Active{static_cast<std::uint32_t>(source), place_m, factor, band_shares,
                                  static_cast<double>(factor) / (r_m * r_m)});
  auto& state = states_[source];
  if (state == nullptr) state = std::make_unique<State>();
  const bool leaps = !(length(place_m - state->last_m) < kLeap_m);
  if (state->generation != generation || leaps) {
    state->traced = 0;
    state->mirrors.clear(key_of(active.source, generation));
    state->has_images = false;
  }
  state->generation = generation;
  state->last_m = place_m;
  if (state->traced == 0) trace(active, state->traced++);
}

// The result tells how far the source or the listener is from the set's place, in parts of what it
// holds for. From 1 on the set is traced again.
double FirstReflections::staleness(const Set& set, const Vec3& place_m) const {
  const double moved = std::max(length(place_m - set.place_m) / set.valid_m,
                                length(listener_m_ - set.listener_m) / set.valid_for_listener_m);
  const bool parts_moved = set.parts_version != parts_version_;
  return parts_moved && keyframe_ >= set.traced_in + kPartsTestedEvery ? 1 + moved : moved;
}

// Lists the sets of a source that are missing of so many, and the stalest one that it has.
void FirstReflections::list_waiting(std::size_t a, std::size_t sets) {
  const Active& active = active_[a];
  State& state = *states_[active.source];
  state.traced = std::min(state.traced, sets);
  const auto list = [&](std::size_t set, double stale) {
    waiting_.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(set),
                        active.loudness * stale * stale});
  };
  for (std::size_t s = state.traced; s < sets; ++s) list(s, kMissing);
  std::size_t stalest = 0;
  double most = 0;
  for (std::size_t s = 0; s < state.traced; ++s) {
    const double stale = staleness(state.sets[s], active.place_m);
    if (stale > most) stalest = s;
    most = std::max(most, stale);
    is_settled_ &= stale < 1 && state.sets[s].parts_version == parts_version_;
  }
  if (most >= 1) list(stalest, most);
}

void FirstReflections::trace() {
  waiting_.clear();
  const std::size_t sets =
      std::clamp<std::size_t>(kMaxSets / std::max<std::size_t>(active_.size(), 1), 1, kSets);
  for (std::size_t a = 0; a < active_.size(); ++a) list_waiting(a, sets);
  const auto first = [](const Waiting& a, const Waiting& b) {
    if (a.urgency != b.urgency) return a.urgency > b.urgency;
    return a.active != b.active ? a.active < b.active : a.set < b.set;
  };
  const std::size_t count = std::min(waiting_.size(), kSetsPerKeyframe);
  std::partial_sort(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count),
                    waiting_.end(), first);
  std::size_t w = 0;
  for (; w < count && rays_left_ > 0; ++w) {
    const Active& active = active_[waiting_[w].active];
    State& state = *states_[active.source];
    state.traced = std::max<std::size_t>(state.traced, waiting_[w].set + 1);
    trace(active, waiting_[w].set);
  }
  is_settled_ &= w == waiting_.size();
  if (with_images_) choose_images();
}

// Gives images to the sources that are the loudest for the listener. The others' mirrors reflect
// through their traced reflections, so that a crowd has no more images than 64 sources.
void FirstReflections::choose_images() {
  const auto weighted = [this](const Active& active) {
    return (states_[active.source]->has_images ? kHysteresis : 1) * active.loudness;
  };
  double least = 0;
  if (active_.size() > kMaxImagedSources) {
    loudness_.clear();
    std::ranges::transform(active_, std::back_inserter(loudness_), weighted);
    const auto last = loudness_.begin() + kMaxImagedSources - 1;
    std::ranges::nth_element(loudness_, last, std::greater<>());
    least = *last;
  }
  for (const Active& active : active_)
    states_[active.source]->has_images = weighted(active) >= least;
}

void FirstReflections::trace(const Active& active, std::size_t s) {
  State& state = *states_[active.source];
  Set& set = state.sets[s];
  set.place_m = active.place_m;
  set.parts_version = parts_version_;
  set.traced_in = keyframe_;
  ++set.count;
  set.reflections.clear();
  set.rows.clear();
  const std::uint64_t key = key_of(active.source, state.generation);
  const auto [rays, nearest_m] = tracer_.trace(active.place_m, listener_m_, key,
                                               static_cast<std::uint32_t>(s), set.reflections);
  rays_left_ -= static_cast<std::int64_t>(rays);
  set.valid_m = std::clamp(kRadiusPerDistance * nearest_m, kMinRadius_m, kMaxRadius_m);
  set.listener_m = listener_m_;
  double heard_m = std::numeric_limits<double>::infinity();  // the nearest reflection
  for (const FirstReflection& reflection : set.reflections) {
    set.rows.add(bounds_, reflection.source, active.place_m);
    heard_m = std::min(heard_m, length(Vec3(reflection.source.position_m) - listener_m_));
  }
  set.valid_for_listener_m =
      std::clamp(kListenerRadiusPerDistance * heard_m, kMinRadius_m, kMaxRadius_m);
  if (with_images_) find_mirrors(state, s);
}

void FirstReflections::find_mirrors(State& state, std::size_t s) const {
  Set& set = state.sets[s];
  set.mirrors.clear();
  state.mirrors.begin_set(s);
  for (const FirstReflection& reflection : set.reflections) {
    const Vec3 normal(reflection.source.normal);
    const MirrorPlane plane{normal, dot(normal, Vec3(reflection.source.position_m))};
    set.mirrors.push_back(reflection.mirrored_rays > 0
                              ? state.mirrors.add(s, set.place_m, plane,
                                                  tracer_.mirrored(reflection.source.material),
                                                  reflection.mirrored_rays)
                              : SourceMirrors::kNone);
  }
  state.mirrors.end_set(state.traced);
}

// The factor of a set's power: the sets that have been traced stand for all.
float FirstReflections::power_of_set(const State& state) {
  return static_cast<float>(kSets) / static_cast<float>(state.traced);
}

std::size_t FirstReflections::find_above(const Vec3& place, double threshold,
                                         std::vector<Found>& found) {
  found.clear();
  std::size_t tested = 0;
  for (const Active& active : active_) {
    const State& state = *states_[active.source];
    const float factor = active.factor * power_of_set(state);
    const auto reached = static_cast<float>(threshold / static_cast<double>(factor));
    for (std::size_t s = 0; s < state.traced; ++s) {
      const Set& set = state.sets[s];
      const FirstReflectionQuery query{Vec3f(active.place_m - set.place_m),
                                       Vec3f(place - set.place_m), reached};
      if (!(set.rows.upper_bound(query.listener_m) >= reached)) continue;
      find_reaching_reflections(set.rows, query, reaching_);
      tested += set.rows.size();
      for (std::size_t r = 0; r < reaching_.count; ++r) {
        const std::uint32_t index = reaching_.index[r];
        const float upper_bound = reaching_.upper_bound[r];
        if (set.rows.mix(index).of(active.band_shares) * upper_bound >= reached)
          found.push_back(
              {active.source, static_cast<std::uint32_t>(s), index, factor * upper_bound});
      }
    }
  }
  return tested;
}

double FirstReflections::upper_bound(const Vec3& place) const {
  double highest = 0;
  for (const Active& active : active_) {
    const State& state = *states_[active.source];
    for (std::size_t s = 0; s < state.traced; ++s) {
      const Set& set = state.sets[s];
      const float bound = set.rows.upper_bound(Vec3f(place - set.place_m));
      highest = std::max(highest, static_cast<double>(active.factor * power_of_set(state)) *
                                      static_cast<double>(bound));
    }
  }
  return highest;
}

Source FirstReflections::moved(const Found& found, const MovingRadiator& radiator) const {
  const State& state = *states_[found.source];
  const Set& set = state.sets[found.set];
  Source source = first_reflection(set.reflections[found.index].source, set.place_m, radiator,
                                   bounds_.radiation().speed_of_sound_mps());
  for (float& power : source.power) power *= power_of_set(state);
  if (state.has_images && state.mirrors.makes_image(set.mirrors[found.index])) {
    const Bands& scattering = tracer_.scattering(source.material);
    for (std::size_t b = 0; b < kBandCount; ++b) source.power[b] *= scattering[b];
    source.material = bounds_.late_material();
  }
  return source;
}

std::uint64_t FirstReflections::number(const Found& found) const {
  const Set& set = states_[found.source]->sets[found.set];
  static_assert(FirstReflectionTracer::kNumbers <= 1 << 18);
  return std::uint64_t{found.source} << 32 | std::uint64_t{set.count & 0x3fffu} << 18 |
         set.reflections[found.index].number;
}

}  // namespace clamor
