#include "runtime/probes/probe_pool.h"

#include <algorithm>

#include "common/memory_size.h"
#include "runtime/propagation/source_number.h"

namespace clamor {

namespace {

constexpr auto kFactorSlack = static_cast<float>(kFloatSlack);
constexpr double kLongestPath_m = 1000;  // from a surface to the listener, for signals' windows

std::vector<Vec3> places_of(const StoredProbes& probes) {
  std::vector<Vec3> places_m;
  for (const StoredProbe& probe : probes.places) places_m.push_back(probe.position_m);
  return places_m;
}

// The share that a source has in the power of a copy.
double share_of(const ProbeCopies::Tree& tree, const ProbeCopy& copy, const Source& stored) {
  return std::min(1.0, static_cast<double>(copy.scale()) * sum_of(stored.power) / tree.power);
}

// The permanent number, beside a representative, of a source that has a share of the tree's power.
double number_beside(double share, float stored_u) {
  return std::min(1.0, share + (1 - share) * static_cast<double>(stored_u));
}

}  // namespace

ProbePool::ProbePool(const StoredProbes& probes, const ProbeBounds& bounds,
                     const OcclusionGeometry& surfaces, FirstReflectionTracer tracer,
                     const SignalWeights& weights, MovingSourceList& moving, PageLoader& loader,
                     bool with_images)
    : bounds_(bounds),
      weights_(weights),
      moving_(moving),
      loader_(loader),
      unit_weights_{{bounds.weights()}},
      context_(bounds.radiation(), unit_weights_, {}, {}),
      traversal_(context_),
      neighbours_(places_of(probes), &surfaces, memory_size(moving.size())),
      first_reflections_(surfaces, std::move(tracer), bounds, memory_size(moving.size()),
                         with_images),
      images_(first_reflections_, moving),
      requests_(loader),
      copies_(probes),
      radiators_(memory_size(moving.size())) {
  for (const Tree& tree : copies_.trees())
    longest_s_ = std::max(longest_s_, static_cast<double>(tree.entry->max_delay_s));
  longest_s_ += kLongestPath_m / bounds.radiation().speed_of_sound_mps();
  moving_.set_longest_reflection(longest_s_);
}

bool ProbePool::refresh() {
  const bool has_arrived = loader_.begin_sample();
  return has_arrived || !neighbours_.is_settled() || !first_reflections_.is_settled();
}

// --- A keyframe ---------------------------------------------------------------------------------

void ProbePool::begin(const QueryKeyframe& keyframe) {
  SourcePool::begin(keyframe);
  const Vec3& place_m = keyframe.place_m();
  context_.bounds.begin(keyframe);
  neighbours_.begin();
  first_reflections_.begin(place_m);
  copies_.begin();
  for (std::size_t slot = 0; slot < moving_.slots(); ++slot)
    if (moving_.reverberation(slot) > 0) add_source(slot);
  first_reflections_.trace();
  copies_.finish();
  for (const std::uint32_t t : copies_.active()) {
    Tree& tree = copies_.tree(t);
    const double bound = context_.bounds.bound(*tree.entry, tree.entry->highest_key, place_m);
    copies_.draw_representatives(
        tree, loader_.use(*tree.entry, static_cast<double>(tree.factor) * bound));
  }
}

void ProbePool::add_source(std::size_t slot) {
  const Vec3 place_m = moving_.place_m(slot);
  const std::uint32_t generation = moving_.generation(slot);
  const auto near = neighbours_.weights(slot, generation, place_m);
  if (near.empty()) return;
  const Radiator& radiator = radiators_[slot] = radiator_of(slot);
  if (!(radiator.factor > 0)) return;
  first_reflections_.add(slot, generation, place_m, radiator.factor, radiator.band_shares);
  copies_.add(slot, generation, near, radiator.factor, radiator.at_any_time);
}

// The factors bound the power of each band, with what the signal plays while the sound that is
// heard now was under way, over the loudness that pages are culled with.
ProbePool::Radiator ProbePool::radiator_of(std::size_t slot) const {
  const MovingSources::Settings& settings = moving_.settings(slot);
  const double now_s = keyframe().time_s - moving_.start_s(slot);
  const Bands loudest = weights_.max_between(moving_.signal(slot), now_s - longest_s_, now_s);
  const Bands& at_any_time = weights_.max(moving_.signal(slot));
  Radiator radiator;
  radiator.position_m = moving_.place_m(slot);
  radiator.axis = Vec3(settings.axis);
  radiator.directivity = moving_.directivity(slot);
  float most = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float gain = settings.reverberation * settings.gain[b];
    radiator.power[b] = gain * gain;
    const float per_loudness = kFactorSlack * gain * gain / bounds_.weights()[b];
    radiator.band_shares[b] = per_loudness * loudest[b];
    radiator.factor = std::max(radiator.factor, radiator.band_shares[b]);
    most = std::max(most, per_loudness * at_any_time[b]);
  }
  if (!(radiator.factor > 0)) return radiator;
  for (float& share : radiator.band_shares) share *= kFactorSlack / radiator.factor;
  radiator.at_any_time = kFactorSlack * most / radiator.factor;
  return radiator;
}

double ProbePool::upper_bound() {
  const Vec3& place_m = keyframe().place_m();
  double highest = first_reflections_.upper_bound(place_m);
  for (const std::uint32_t t : copies_.active()) {
    const Tree& tree = copies_.trees()[t];
    const PageEntry& top = *tree.entry;
    for (const ProbeCopy& copy : copies_.of(tree)) {
      const double power = std::max(static_cast<double>(top.highest_key),
                                    tree.power / static_cast<double>(copy.scale()));
      const double key = power / static_cast<double>(copy.u);
      highest = std::max(
          highest, static_cast<double>(copy.factor) * context_.bounds.bound(top, key, place_m));
    }
  }
  return highest;
}

// Where pages are missing, only those sources with lower keys that are in memory may be chosen.
// A source with the power P_i is among them if its number is below P_i over that key.
double ProbePool::missing_key(const FoundSource& found, double /*threshold*/) {
  if (found.frame == 0) return 0;  // a first reflection
  const Placed& placed = placed_[found.frame - 1];
  const double missing = copies_.trees()[placed.tree].missing_key;
  if (missing == 0 || placed.is_representative) return 0;
  const double stored_share = std::min(1.0, placed.stored_power / missing);
  const double inclusion = placed.share + (1 - placed.share) * stored_share;
  return sum_of(placed.source.power) / std::max(inclusion, 1e-12);
}

// --- Queries -------------------------------------------------------------------------------------

bool ProbePool::find_above(double threshold, std::size_t max_count,
                           std::vector<FoundSource>& found) {
  placed_count_ = 0;
  requests_.begin_query();
  for (const std::uint32_t t : copies_.active())
    if (!find_in_tree(copies_.tree(t), threshold, max_count, found)) return false;
  find_first_reflections(threshold, max_count, found);
  return found.size() <= max_count && !is_exhausted();
}

bool ProbePool::find_in_tree(Tree& tree, double threshold, std::size_t max_count,
                             std::vector<FoundSource>& found) {
  const auto factor = static_cast<double>(tree.factor);
  tree.missing_key = 0;
  traversal_.start({keyframe().place_m(), 0, threshold / factor}, *tree.entry, tree.first_source);
  for (OctreeTraversal::Node node; traversal_.next(node);) {
    spend(WorkBudget::kNode);
    const double bound = factor * node.bound;
    const ResidentPage* const page =
        node.entry == tree.entry ? tree.top : loader_.use(*node.entry, bound);
    if (page == nullptr) {
      requests_.add_missing(*node.entry, bound, bound);
      tree.missing_key = std::max(tree.missing_key, static_cast<double>(node.entry->highest_key));
      continue;
    }
    find_in_page(tree, *page, node.first, threshold, found);
    if (found.size() > max_count || is_exhausted()) return false;
    traversal_.expand(node, *page);
  }
  if (tree.top != nullptr) find_representatives(tree, threshold, found);
  return found.size() <= max_count;
}

void ProbePool::find_in_page(const Tree& tree, const ResidentPage& page, std::uint64_t first,
                             double threshold, std::vector<FoundSource>& found) {
  page.sources.cull(keyframe().place_m(), 0, threshold / static_cast<double>(tree.factor), culled_);
  spend(page.sources.size() / 8);
  for (std::size_t s = 0; s < culled_.count; ++s) {
    const std::size_t index = culled_.index[s];
    const Source& stored = page.sources[index];
    const std::uint64_t number = first + index;
    // The page's bounds hold for the stored u.
    const double share = static_cast<double>(std::max(stored.u, kMinU)) /
                         number_beside(sum_of(stored.power) / tree.power, stored.u);
    BoostedBound bound = boosted(stored, number, share);
    bound.upper_bound *= static_cast<double>(culled_.upper_bound[s]);
    spend(1);
    const BandMix mix = page.sources.mix(index);
    for (const ProbeCopies::Crowd& crowd : copies_.crowds(tree)) {
      if (bound.upper_bound * static_cast<double>(crowd.factor) < threshold) continue;
      for (const ProbeCopy& copy : copies_.holders(crowd, number))
        if (&page != tree.top || index != copy.representative)
          add(copy, {stored, number}, mix, bound, threshold, found);
    }
  }
}

void ProbePool::find_representatives(const Tree& tree, double threshold,
                                     std::vector<FoundSource>& found) {
  if (tree.share_ends.empty()) return;
  spend(WorkBudget::kFound / 2 * tree.copy_count);
  const SourcePage& page = tree.top->sources;
  for (const ProbeCopy& copy : copies_.of(tree)) {
    const std::size_t index = copy.representative;
    const Source& stored = page[index];
    const std::uint64_t number = tree.first_source + index;
    const SourceBound at_1m = page.bound(index);
    const Vec3 away_m = keyframe().place_m() - Vec3(stored.position_m);
    const double r2_m2 =
        std::max(dot(away_m, away_m) * 0.999 - 0.001, static_cast<double>(at_1m.radius2_m2));
    const double own_u = static_cast<double>(copy.u) * share_of(tree, copy, stored);
    const double upper_bound =
        static_cast<double>(at_1m.diffuse + at_1m.compensation + at_1m.lobe) / r2_m2 *
        static_cast<double>(stored.u) / std::max(own_u, static_cast<double>(kMinU));
    add(copy, {stored, number, true}, page.mix(index), boosted(stored, number, upper_bound),
        threshold, found);
  }
}

// Bounds are stored with the late boost at full strength.
BoostedBound ProbePool::boosted(const Source& stored, std::uint64_t number,
                                double upper_bound) const {
  const OcclusionUpperBounds* const occlusion = keyframe().occlusion;
  if (occlusion != nullptr) upper_bound *= static_cast<double>(occlusion->upper_bound(number));
  return {bounds_.radiation().late_boost().at(stored.delay_s), keyframe().late_boost, upper_bound};
}

void ProbePool::find_first_reflections(double threshold, std::size_t max_count,
                                       std::vector<FoundSource>& found) {
  const std::size_t tested =
      first_reflections_.find_above(keyframe().place_m(), threshold, reaching_);
  spend(WorkBudget::kFirstReflectionsPer16 * tested / 16);
  for (const FirstReflections::Found& one : reaching_) {
    if (found.size() > max_count || is_exhausted()) return;
    const FirstReflection& stored = first_reflections_.stored(one);
    const std::uint64_t number = kFirstTracedReflection + first_reflections_.number(one);
    const BoostedBound bound = boosted(stored.source, number, static_cast<double>(one.upper_bound));
    if (bound.upper_bound < threshold) continue;
    float openness = 1;
    stored.portals.for_each([&](std::size_t portal) {
      if (portal < openness_.size()) openness *= openness_[portal];
    });
    if (!(openness > 0)) continue;
    const Radiator& radiator = radiators_[one.source];
    Placed& placed = next_placed();
    placed.source = first_reflections_.moved(one, radiator);
    if (!has_left(placed.source, one.source)) continue;
    FoundSource& of_found = append(placed, one.source, 1, number, found);
    of_found.boost = bound.boost;
    of_found.openness = openness;
    of_found.upper_bound = bound.upper_bound * static_cast<double>(radiator.at_any_time);
  }
}

// Whether what is heard now of a reflection left its moving source before that was removed.
bool ProbePool::has_left(const Source& source, std::size_t slot) const {
  const double end_s = moving_.end_s(slot), time_s = keyframe().time_s;
  if (end_s >= time_s) return true;
  const double path_m = length(keyframe().place_m() - Vec3(source.position_m));
  return time_s - static_cast<double>(source.delay_s) -
             path_m / bounds_.radiation().speed_of_sound_mps() <=
         end_s;
}

// Adds the source of a copy if it may reach the threshold. `bound` is for a factor of 1.
void ProbePool::add(const ProbeCopy& copy, const Stored& stored, const BandMix& mix,
                    const BoostedBound& bound, double threshold, std::vector<FoundSource>& found) {
  const Radiator& radiator = radiators_[copy.slot];
  const double in_loudest_band = bound.upper_bound * static_cast<double>(copy.factor);
  if (in_loudest_band < threshold ||
      in_loudest_band * static_cast<double>(mix.of(radiator.band_shares)) < threshold)
    return;
  const Source& source = stored.source;
  const std::uint32_t portal_set = source.path.portal_set;
  const float openness = portal_set < openness_by_set_.size() ? openness_by_set_[portal_set] : 1.0f;
  if (!(openness > 0)) return;
  const Tree& tree = copies_.trees()[copy.tree];
  Placed& placed = next_placed();
  placed.source = tree.probe_m ? early_reflection(source, *tree.probe_m, radiator,
                                                  bounds_.radiation().speed_of_sound_mps())
                               : late_reflection(source, radiator, bounds_.late_material());
  if (!has_left(placed.source, copy.slot)) return;
  placed.tree = copy.tree;
  placed.stored_power = sum_of(source.power);
  placed.share = share_of(tree, copy, source);
  placed.is_representative = stored.is_representative;
  placed.source.u =
      static_cast<float>(stored.is_representative ? static_cast<double>(copy.u) * placed.share
                                                  : number_beside(placed.share, source.u));
  FoundSource& one = append(placed, copy.slot, copy.weight, stored.number, found);
  one.frame = static_cast<std::uint32_t>(placed_count_);
  one.boost = bound.boost;
  one.openness = openness;
  one.upper_bound = in_loudest_band * static_cast<double>(radiator.at_any_time);
}

// Room for a source, which append() takes.
ProbePool::Placed& ProbePool::next_placed() {
  if (placed_count_ == placed_.size()) placed_.emplace_back();
  return placed_[placed_count_];
}

// Appends the source of a moving source's reflection, and gives it the power of that.
FoundSource& ProbePool::append(Placed& placed, std::size_t slot, float weight, std::uint64_t number,
                               std::vector<FoundSource>& found) {
  ++placed_count_;
  placed.source.emitter = moving_.emitter(slot);
  for (std::size_t b = 0; b < kBandCount; ++b)
    placed.source.power[b] *= weight * radiators_[slot].power[b];
  FoundSource& one = found.emplace_back();
  one.source = &placed.source;
  one.number = number;
  one.signal = moving_.signal(slot);
  one.voice = voice_number(moving_.number(slot), number);
  one.start_s = moving_.start_s(slot);
  spend(WorkBudget::kFound);
  return one;
}

}  // namespace clamor
