#include "runtime/probes/probe_pool.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "common/random.h"
#include "runtime/propagation/source_number.h"
#include "runtime/query/work_budget.h"

namespace clamor {

namespace {

constexpr float kFactorSlack = 1.00001f;  // for the rounding of factors
constexpr std::uint32_t kSeedOfCopies = 0x70726f62;
// Target number of copies per source of a tree, after thinning.
constexpr double kCopiesPerSource = 8;
// A copy holds at least so many sources of its tree's top page, or nearly.
constexpr double kLeastTopSources = 4;
constexpr double kLongestPath_m = 1000;  // from a surface to the listener, for signals' windows

std::vector<Vec3> places_of(const StoredProbes& probes) {
  std::vector<Vec3> places_m;
  for (const StoredProbe& probe : probes.places) places_m.push_back(probe.position_m);
  return places_m;
}

// Multiples of the golden ratio: of n consecutive numbers, no two neighbouring hashes are further
// apart than 2.7 / n of the range, so that no copy is left without a source of the top page.
std::uint32_t hash_of(std::uint64_t probe_source) {
  return static_cast<std::uint32_t>(probe_source * 0x9e3779b97f4a7c15u >> 32);
}

// The first hash that agrees with this one in its first `level` bits.
std::uint32_t first_alike(std::uint32_t hash, std::uint32_t level) {
  return level == 0 ? 0 : hash & ~(~std::uint32_t{0} >> level);
}

// A copy holds one in 2^level sources of its tree. It holds all where there are few copies, and
// where it makes up much of the loudness of all of them: its own voices are heard then.
std::uint32_t crowd_level(double loudness, double all_loudness, std::size_t copies,
                          std::size_t top_sources) {
  const double others = std::min(static_cast<double>(copies), all_loudness / loudness);
  const double excess =
      std::min(others / kCopiesPerSource, static_cast<double>(top_sources) / kLeastTopSources);
  return excess < 2 ? 0 : static_cast<std::uint32_t>(std::ilogb(excess));
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
      node_bounds_(bounds.radiation(), unit_weights_, {}, {}),
      neighbours_(places_of(probes), &surfaces, moving.max_sources()),
      first_reflections_(surfaces, std::move(tracer), bounds, moving.max_sources(), with_images),
      requests_(loader),
      radiators_(moving.max_sources()) {
  std::uint64_t first = kFirstProbeSource;
  const auto add_tree = [&](const PageEntry& top, const std::optional<Vec3>& probe_m) {
    Tree& tree = trees_.emplace_back();
    tree.entry = &top;
    tree.probe_m = probe_m;
    tree.first_source = first;
    tree.power = total_power(top);
    first += top.sources_below;
  };
  for (const StoredProbe& probe : probes.places) {
    add_tree(probe.tree.top, probe.position_m);
    zone_trees_.push_back(static_cast<std::uint32_t>(probes.places.size() + probe.zone));
  }
  for (const StoredTree& zone : probes.zones) add_tree(zone.top, std::nullopt);
  for (const Tree& tree : trees_)
    longest_s_ = std::max(longest_s_, static_cast<double>(tree.entry->max_delay_s));
  longest_s_ += kLongestPath_m / bounds.radiation().speed_of_sound_mps();
  moving_.set_longest_reflection(longest_s_);
}

bool ProbePool::refresh() {
  const bool has_arrived = loader_.begin_sample();
  return has_arrived || !neighbours_.is_settled() || !first_reflections_.is_settled();
}

void ProbePool::set_late_boost(float strength) {
  boost_strength_ = strength;
  node_bounds_.set_late_boost(strength);
}

// --- The copies of a keyframe --------------------------------------------------------------------

void ProbePool::begin(const Listener& listener, double time_s) {
  time_s_ = time_s;
  place_m_ = listener.position_m;
  node_bounds_.begin(listener.position_m, time_s);
  neighbours_.begin();
  first_reflections_.begin(listener.position_m);
  for (const std::uint32_t t : active_) trees_[t].copy_count = trees_[t].crowd_count = 0;
  active_.clear();
  copies_.clear();
  crowds_.clear();
  for (std::size_t slot = 0; slot < moving_.slots(); ++slot)
    if (moving_.reverberation(slot) > 0) add_copies(slot, time_s);
  first_reflections_.trace();
  list_images();
  thin_crowds();
  sort_copies();
  for (const std::uint32_t t : active_) {
    read_top(trees_[t], listener.position_m);
    draw_representatives(trees_[t]);
  }
}

void ProbePool::add_copies(std::size_t slot, double time_s) {
  const Vec3 place_m = moving_.place_m(slot);
  const auto near = neighbours_.weights(slot, moving_.generation(slot), place_m);
  if (near.empty()) return;
  radiators_[slot] = radiator_of(slot, time_s - moving_.start_s(slot));
  if (!(radiators_[slot].factor > 0)) return;
  first_reflections_.add(slot, moving_.generation(slot), place_m, radiators_[slot].factor,
                         radiators_[slot].band_shares);
  std::array<ProbeWeight, kMaxCopies> zones{};
  std::size_t zone_count = 0;
  for (const ProbeWeight& weight : near) {
    add_copy(slot, weight.probe, weight.weight);
    const std::uint32_t tree = zone_trees_[weight.probe];
    std::size_t z = 0;
    while (z < zone_count && zones[z].probe != tree) ++z;
    zone_count = std::max(zone_count, z + 1);
    zones[z].probe = tree;
    zones[z].weight += weight.weight;
  }
  for (const ProbeWeight& zone : std::span(zones).first(zone_count))
    add_copy(slot, zone.probe, zone.weight);
}

// The factors bound the power of each band, with what the signal plays while the sound that is
// heard now was under way, over the loudness that pages are culled with.
ProbePool::Radiator ProbePool::radiator_of(std::size_t slot, double now_s) const {
  const MovingSources::Settings& settings = moving_.settings(slot);
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

void ProbePool::add_copy(std::size_t slot, std::uint32_t tree, float weight) {
  if (!(trees_[tree].power > 0 && weight > 0)) return;
  Copy& copy = copies_.emplace_back();
  copy.tree = tree;
  copy.slot = static_cast<std::uint32_t>(slot);
  copy.weight = weight;
  copy.factor = weight * radiators_[slot].factor;
  copy.loudness = copy.factor * radiators_[slot].at_any_time;
  const RandomBits bits = philox(kSeedOfCopies, {copy.slot, moving_.generation(slot), tree, 0});
  copy.u = static_cast<float>(unit_above_zero(bits[0]));
  copy.draw = unit(bits[1]);
  copy.hash = bits[2];
  Tree& of_copy = trees_[tree];
  if (of_copy.copy_count++ == 0) {
    active_.push_back(tree);
    of_copy.factor = 0;
    of_copy.loudness = 0;
  }
  of_copy.loudness += static_cast<double>(copy.loudness);
}

void ProbePool::thin_crowds() {
  for (Copy& copy : copies_) {
    const Tree& tree = trees_[copy.tree];
    copy.level = crowd_level(static_cast<double>(copy.loudness), tree.loudness, tree.copy_count,
                             tree.entry->source_count);
    const auto scale = copy.scale();
    copy.weight *= scale;
    copy.factor *= scale;
  }
}

void ProbePool::sort_copies() {
  std::sort(copies_.begin(), copies_.end(), [](const Copy& a, const Copy& b) {
    return std::tie(a.tree, a.level, a.hash, a.slot) < std::tie(b.tree, b.level, b.hash, b.slot);
  });
  for (std::size_t c = 0; c < copies_.size(); ++c) {
    const Copy& copy = copies_[c];
    Tree& tree = trees_[copy.tree];
    if (tree.crowd_count == 0) {
      tree.first_copy = static_cast<std::uint32_t>(c);
      tree.first_crowd = static_cast<std::uint32_t>(crowds_.size());
    }
    if (tree.crowd_count == 0 || crowds_.back().level != copy.level) {
      ++tree.crowd_count;
      crowds_.push_back({copy.level, static_cast<std::uint32_t>(c), 0, 0});
    }
    ++crowds_.back().copy_count;
    crowds_.back().factor = std::max(crowds_.back().factor, copy.factor);
    tree.factor = std::max(tree.factor, copy.factor);
  }
}

// The copies of a crowd that hold sources with this hash.
std::span<const ProbePool::Copy> ProbePool::holders(const Crowd& crowd, std::uint32_t hash) const {
  const auto all = std::span(copies_).subspan(crowd.first_copy, crowd.copy_count);
  if (crowd.level == 0) return all;
  const std::uint32_t from = first_alike(hash, crowd.level);
  const auto first = std::lower_bound(all.begin(), all.end(), from,
                                      [](const Copy& copy, auto h) { return copy.hash < h; });
  auto last = first;
  while (last != all.end() && first_alike(last->hash, crowd.level) == from) ++last;
  return {first, last};
}

// --- Queries -------------------------------------------------------------------------------------

// Upper bound of the priorities in a node and below, over all copies.
double ProbePool::bound(const Tree& tree, const PageEntry& entry, const Vec3& place) const {
  return static_cast<double>(tree.factor) * node_bounds_.bound(entry, entry.highest_key, place);
}

// Takes in the top page: each of its sources represents itself, or what the highest missing key
// hides below it, so that together they represent the whole tree.
void ProbePool::read_top(Tree& tree, const Vec3& place) {
  const ResidentPage* const top = loader_.use(*tree.entry, bound(tree, *tree.entry, place));
  if (top == tree.top) return;
  tree.top = top;
  tree.share_ends.clear();
  tree.order.clear();
  if (top == nullptr) return;
  double highest_below = 0, sum = 0;
  for (const PageEntry& child : top->links.children)
    highest_below = std::max(highest_below, static_cast<double>(child.highest_key));
  tree.order.resize(top->sources.size());
  std::iota(tree.order.begin(), tree.order.end(), 0);
  std::ranges::sort(tree.order, {},
                    [&](std::uint32_t i) { return hash_of(tree.first_source + i); });
  for (const std::uint32_t i : tree.order)
    tree.share_ends.push_back(sum += std::max(sum_of(top->sources[i].power), highest_below));
}

void ProbePool::draw_representatives(const Tree& tree) {
  const auto& ends = tree.share_ends;
  if (ends.empty()) return;
  const auto place_of = [&](std::uint64_t hash) {
    return std::ranges::lower_bound(
               tree.order, hash, {},
               [&](std::uint32_t i) { return std::uint64_t{hash_of(tree.first_source + i)}; }) -
           tree.order.begin();
  };
  for (Copy& copy : std::span(copies_).subspan(tree.first_copy, tree.copy_count)) {
    std::ptrdiff_t first = 0, end = std::ssize(ends);
    if (copy.level > 0) {
      const std::uint64_t from = first_alike(copy.hash, copy.level);
      first = place_of(from);
      end = place_of(from + (std::uint64_t{1} << (32 - copy.level)));
    }
    const double before = first == 0 ? 0 : ends[static_cast<std::size_t>(first - 1)];
    const double share = before + copy.draw * (ends[static_cast<std::size_t>(end - 1)] - before);
    const auto at = std::upper_bound(ends.begin() + first, ends.begin() + end, share);
    copy.representative =
        tree.order[static_cast<std::size_t>(std::min(at - ends.begin(), end - 1))];
  }
}

bool ProbePool::find_above(const Vec3& place, double threshold, std::size_t max_count,
                           std::vector<FoundSource>& found) {
  placed_count_ = 0;
  requests_.begin_query();
  for (const std::uint32_t t : active_)
    if (!find_in_tree(trees_[t], place, threshold, max_count, found)) return false;
  find_first_reflections(place, threshold, max_count, found);
  find_images(threshold, found);
  return found.size() <= max_count && !is_exhausted();
}

bool ProbePool::find_in_tree(Tree& tree, const Vec3& place, double threshold, std::size_t max_count,
                             std::vector<FoundSource>& found) {
  tree.missing_key = 0;
  waiting_.assign(1, {tree.entry, tree.first_source});
  while (!waiting_.empty()) {
    const auto [entry, first] = waiting_.back();
    waiting_.pop_back();
    const double reached = bound(tree, *entry, place);
    const bool is_top = entry == tree.entry;
    if (!is_top && !(reached > 0 && reached >= threshold)) continue;
    spend(WorkBudget::kNode);
    const ResidentPage* const page = is_top ? tree.top : loader_.use(*entry, reached);
    if (page == nullptr) {
      requests_.add_missing(*entry, reached, reached);
      tree.missing_key = std::max(tree.missing_key, static_cast<double>(entry->highest_key));
      continue;
    }
    find_in_page(tree, *page, first, place, threshold, found);
    if (found.size() > max_count || is_exhausted()) return false;
    std::uint64_t next = first + entry->source_count;
    for (const PageEntry& child : page->links.children) {
      waiting_.push_back({&child, next});
      next += child.sources_below;
    }
  }
  if (tree.top != nullptr) find_representatives(tree, place, threshold, found);
  return found.size() <= max_count;
}

void ProbePool::find_in_page(const Tree& tree, const ResidentPage& page, std::uint64_t first,
                             const Vec3& place, double threshold, std::vector<FoundSource>& found) {
  page.sources.cull(place, 0, threshold / static_cast<double>(tree.factor), culled_);
  spend(page.sources.size() / 8);
  for (std::size_t s = 0; s < culled_.count; ++s) {
    const std::size_t index = culled_.index[s];
    const Source& stored = page.sources[index];
    const std::uint64_t number = first + index;
    // The page's bounds hold for the stored u, with the late boost at full strength.
    double share = static_cast<double>(std::max(stored.u, kMinU)) /
                   number_beside(sum_of(stored.power) / tree.power, stored.u);
    if (occlusion_ != nullptr) share *= static_cast<double>(occlusion_->upper_bound(number));
    const BoostedBound boosted(bounds_.radiation().late_boost().at(stored.delay_s), boost_strength_,
                               share);
    const double upper_bound = boosted.upper_bound * static_cast<double>(culled_.upper_bound[s]);
    spend(1);
    const BandMix mix = page.sources.mix(index);
    for (const Crowd& crowd : std::span(crowds_).subspan(tree.first_crowd, tree.crowd_count)) {
      if (upper_bound * static_cast<double>(crowd.factor) < threshold) continue;
      for (const Copy& copy : holders(crowd, hash_of(number))) {
        const double in_loudest_band = upper_bound * static_cast<double>(copy.factor);
        if (in_loudest_band < threshold) continue;
        const Bands& shares = radiators_[copy.slot].band_shares;
        if (in_loudest_band * static_cast<double>(mix.of(shares)) < threshold) continue;
        if (&page == tree.top && index == copy.representative) continue;
        add(tree, copy, stored, number, false, boosted.boost, in_loudest_band, found);
      }
    }
  }
}

void ProbePool::find_first_reflections(const Vec3& place, double threshold, std::size_t max_count,
                                       std::vector<FoundSource>& found) {
  const std::size_t tested = first_reflections_.find_above(place, threshold, reaching_);
  spend(WorkBudget::kFirstReflectionsPer16 * tested / 16);
  for (const FirstReflections::Found& one : reaching_) {
    if (found.size() > max_count || is_exhausted()) return;
    const FirstReflection& stored = first_reflections_.stored(one);
    const std::uint64_t number = kFirstTracedReflection + first_reflections_.number(one);
    double upper_bound = static_cast<double>(one.upper_bound);
    if (occlusion_ != nullptr) upper_bound *= static_cast<double>(occlusion_->upper_bound(number));
    const BoostedBound boosted(bounds_.radiation().late_boost().at(stored.source.delay_s),
                               boost_strength_, upper_bound);
    if (boosted.upper_bound < threshold) continue;
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
    of_found.boost = boosted.boost;
    of_found.openness = openness;
    of_found.upper_bound = boosted.upper_bound * static_cast<double>(radiator.at_any_time);
  }
}

// --- Images --------------------------------------------------------------------------------------

// A listener hears the image of a source as the listener's own image hears the source; one behind
// the mirror does not hear it.
void ProbePool::list_images() {
  images_.clear();
  first_reflections_.for_each_image([&](std::uint32_t slot, const SourceMirrors::Mirror& mirror) {
    if (dot(mirror.plane.normal, place_m_) <= mirror.plane.offset_m) return;
    Image& image = images_.emplace_back();
    image.slot = slot;
    image.mirror = mirror.number;
    image.plane = mirror.plane;
    image.source.u = mirror.u;
    const auto gain = static_cast<double>(moving_.settings(slot).reverberation);
    image.upper_bound = gain * gain * static_cast<double>(mirror.reflected) *
                        moving_.upper_bound_times_u(slot, mirror.plane.image_of(place_m_)) /
                        static_cast<double>(std::max(image.source.u, kMinU));
  });
}

void ProbePool::find_images(double threshold, std::vector<FoundSource>& found) {
  for (Image& image : images_) {
    if (!(image.upper_bound > 0 && image.upper_bound >= threshold)) continue;
    if (!image.is_placed) place(image);
    FoundSource& one = found.emplace_back();
    one.source = &image.source;
    one.signal = moving_.signal(image.slot);
    one.voice = voice_number(moving_.number(image.slot), kFirstImage + image.mirror);
    one.number = one.voice ^ image.cell;
    one.velocity_mps = image.velocity_mps;
    one.start_s = moving_.start_s(image.slot);
    one.upper_bound = image.upper_bound;
    spend(WorkBudget::kFound);
  }
}

void ProbePool::place(Image& image) {
  const MirrorPlane& plane = image.plane;
  const MovingSourceList::Heard heard = moving_.heard_at(image.slot, plane.image_of(place_m_));
  const float u = image.source.u, gain = moving_.settings(image.slot).reverberation;
  image.source = heard.source;
  image.source.u = u;
  image.source.is_image = true;
  image.source.mirror = heard.source.position_m;
  image.source.position_m = Vec3f(plane.image_of(Vec3(heard.source.position_m)));
  image.source.normal = Vec3f(plane.mirrored(Vec3(heard.source.normal)));
  for (float& power : image.source.power) power *= gain * gain;
  image.velocity_mps = Vec3f(plane.mirrored(Vec3(heard.velocity_mps)));
  image.cell = heard.cell;
  image.is_placed = true;
}

// --- Copies of trees -----------------------------------------------------------------------------

void ProbePool::find_representatives(const Tree& tree, const Vec3& place, double threshold,
                                     std::vector<FoundSource>& found) {
  if (tree.share_ends.empty()) return;
  spend(WorkBudget::kFound / 2 * tree.copy_count);
  for (const Copy& copy : copies_of(tree)) {
    const std::size_t index = copy.representative;
    const Source& stored = tree.top->sources[index];
    const std::uint64_t number = tree.first_source + index;
    const SourceBound at_1m = tree.top->sources.bound(index);
    const Vec3 away_m = place - Vec3(stored.position_m);
    const double r2_m2 =
        std::max(dot(away_m, away_m) * 0.999 - 0.001, static_cast<double>(at_1m.radius2_m2));
    // The page's bounds hold for the stored u, with the late boost at full strength.
    const double own_u = static_cast<double>(copy.u) * share_of(tree, copy, stored);
    double upper_bound = static_cast<double>(at_1m.diffuse + at_1m.compensation + at_1m.lobe) /
                         r2_m2 * static_cast<double>(stored.u) /
                         std::max(own_u, static_cast<double>(kMinU));
    if (occlusion_ != nullptr) upper_bound *= static_cast<double>(occlusion_->upper_bound(number));
    const BoostedBound boosted(bounds_.radiation().late_boost().at(stored.delay_s), boost_strength_,
                               upper_bound);
    const double bound = boosted.upper_bound * static_cast<double>(copy.factor);
    if (bound < threshold) continue;
    const BandMix mix = tree.top->sources.mix(index);
    if (bound * static_cast<double>(mix.of(radiators_[copy.slot].band_shares)) >= threshold)
      add(tree, copy, stored, number, true, boosted.boost, bound, found);
  }
}

// Whether what is heard now of a reflection left its moving source before that was removed.
bool ProbePool::has_left(const Source& source, std::size_t slot) const {
  const double end_s = moving_.end_s(slot);
  if (end_s >= time_s_) return true;
  const double path_m = length(place_m_ - Vec3(source.position_m));
  return time_s_ - static_cast<double>(source.delay_s) -
             path_m / bounds_.radiation().speed_of_sound_mps() <=
         end_s;
}

void ProbePool::add(const Tree& tree, const Copy& copy, const Source& stored, std::uint64_t number,
                    bool is_representative, float boost, double bound,
                    std::vector<FoundSource>& found) {
  const std::uint32_t portal_set = portal_set_of(stored.emitter);
  const float openness = portal_set < openness_by_set_.size() ? openness_by_set_[portal_set] : 1.0f;
  if (!(openness > 0)) return;
  Placed& placed = next_placed();
  const MovingRadiator& radiator = radiators_[copy.slot];
  placed.source = tree.probe_m ? early_reflection(stored, *tree.probe_m, radiator,
                                                  bounds_.radiation().speed_of_sound_mps())
                               : late_reflection(stored, radiator, bounds_.late_material());
  if (!has_left(placed.source, copy.slot)) return;
  placed.tree = copy.tree;
  placed.stored_power = sum_of(stored.power);
  placed.share = share_of(tree, copy, stored);
  placed.is_representative = is_representative;
  placed.source.u =
      static_cast<float>(is_representative ? static_cast<double>(copy.u) * placed.share
                                           : number_beside(placed.share, stored.u));
  FoundSource& one = append(placed, copy.slot, copy.weight, number, found);
  one.frame = static_cast<std::uint32_t>(placed_count_);
  one.boost = boost;
  one.openness = openness;
  one.upper_bound = bound * static_cast<double>(radiators_[copy.slot].at_any_time);
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

double ProbePool::upper_bound(const Vec3& place) {
  double highest = first_reflections_.upper_bound(place);
  for (const Image& image : images_) highest = std::max(highest, image.upper_bound);
  for (const std::uint32_t t : active_) {
    const Tree& tree = trees_[t];
    const PageEntry& top = *tree.entry;
    for (const Copy& copy : copies_of(tree)) {
      const double power = std::max(static_cast<double>(top.highest_key),
                                    tree.power / static_cast<double>(copy.scale()));
      const double key = power / static_cast<double>(copy.u);
      highest =
          std::max(highest, static_cast<double>(copy.factor) * node_bounds_.bound(top, key, place));
    }
  }
  return highest;
}

// Where pages are missing, only those sources with lower keys that are in memory may be chosen.
// A source with the power P_i is among them if its number is below P_i over that key.
double ProbePool::missing_key(const FoundSource& found) const {
  const Placed& placed = placed_[found.frame - 1];
  const double missing = trees_[placed.tree].missing_key;
  if (missing == 0 || placed.is_representative) return 0;
  const double stored_share = std::min(1.0, placed.stored_power / missing);
  const double inclusion = placed.share + (1 - placed.share) * stored_share;
  return sum_of(placed.source.power) / std::max(inclusion, 1e-12);
}

void ProbePool::request_pages(double threshold) { requests_.send(threshold); }

}  // namespace clamor
