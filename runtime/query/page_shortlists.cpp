#include "runtime/query/page_shortlists.h"

#include <algorithm>
#include <limits>

namespace clamor {

using namespace query;

PageShortlists::PageShortlists(const RadiationModel& radiation, const SignalWeights& weights)
    : radiation_(radiation), weights_(weights) {}

void PageShortlists::begin(const QueryKeyframe& keyframe, double max_share, double until_s) {
  const bool is_earlier = keyframe.time_s < keyframe_.time_s;
  keyframe_ = keyframe;
  max_share_ = max_share;
  quiet_until_s_ = until_s;
  if (++keyframes_ % kListLifetime_keyframes == 0 || is_earlier) drop_lists(is_earlier);
  const double error_s =
      (kMaxListRadius_m + 1e-3) / radiation_.speed_of_sound_mps() + kDelayError_s;
  loudness_.tabulate(weights_.tracks, keyframe.time_s, max_delay_s_, static_cast<float>(error_s));
}

// All, or those that were not used for long.
void PageShortlists::drop_lists(bool all) {
  const auto dropped = std::erase_if(lists_, [&](const List& list) {
    return all || keyframes_ - list.used > kListLifetime_keyframes;
  });
  if (dropped == 0) return;
  list_of_.clear(lists_.size());
  for (std::uint32_t l = 0; l < lists_.size(); ++l) list_of_[lists_[l].first] = l + 1;
  ++generation_;
}

std::uint32_t PageShortlists::list_of(std::uint64_t first) {
  std::uint32_t& list = list_of_[first];
  if (list == 0) {
    lists_.emplace_back(&memory_).first = first;
    list = static_cast<std::uint32_t>(lists_.size());
  }
  lists_[list - 1].used = keyframes_;
  return list - 1;
}

std::size_t PageShortlists::use(std::uint32_t list) {
  lists_[list].used = keyframes_;
  work_ += lists_[list].count / 4;
  return lists_[list].count;
}

// --- Making a list ------------------------------------------------------------------------------

// A listener who walks on reaches the centre of the ball first, and then its far side. One who
// leaves the ball at once gets a list that holds here and now only.
ValidityRegion PageShortlists::region_for(const List& list, const ShortlistPage& page) const {
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  const double speed_mps = length(keyframe_.listener.velocity_mps);
  const bool is_new = list.region.radius_m < 0;
  const ListReach& reach = is_new || list.count > kShortList ? kListReach
                           : list.count > 0                  ? kShortListReach
                                                             : kEmptyListReach;
  const double radius_m =
      std::clamp(reach.radius_per_distance * distance_m(page.bounds, page.query.centre),
                 reach.min_radius_m / scale, kMaxListRadius_m / scale);
  if (kMinListDuration_s * speed_mps >= scale * radius_m)
    return {page.query.centre, 0, kListReach.threshold * page.query.threshold};
  Vec3 ahead = speed_mps > 0 ? keyframe_.listener.velocity_mps / speed_mps : Vec3(0);
  if (page.placement != nullptr) ahead = glm::transpose(page.placement->rotation) * ahead;
  return {page.query.centre + kListLead * radius_m * ahead, radius_m,
          reach.threshold * thresholds_.share() * page.query.threshold};
}

std::size_t PageShortlists::renew(std::uint32_t index, const ShortlistPage& page) {
  List& list = lists_[index];
  list.region = region_for(list, page);
  list.used = keyframes_;
  list.count = 0;
  list.blocks.clear();
  list.bounds.clear();
  // Where all signals are quiet for a while, few sources pass; but the list ends with that while.
  const bool all_quiet = max_share_ < kQuietShare;
  if (all_quiet) list.region.until_s = quiet_until_s_;
  page.sources.cull(list.region.centre, list.region.radius_m + page.error_m,
                    list.region.threshold / (all_quiet ? max_share_ : 1), culled_);
  // Sources lie elsewhere in memory.
  for (std::size_t s = 0; s < culled_.count; ++s)
    SourcePage::prefetch(page.sources[culled_.index[s]]);
  for (std::size_t s = 0; s < culled_.count; ++s)
    add(list, page, culled_.index[s], culled_.upper_bound[s]);
  work_ += WorkBudget::kCulledSource * culled_.tested + WorkBudget::kListedSource * list.count;
  return culled_.tested;
}

void PageShortlists::add(List& list, const ShortlistPage& page, std::size_t index,
                         float upper_bound) {
  const Source& stored = page.sources[index];
  std::uint32_t emitter = stored.emitter;
  float emission_s = stored.delay_s;
  double scale = 1;
  if (page.placement != nullptr) {
    emitter += page.placement->emitters;
    if (emitter >= radiation_.emitter_count()) return;  // of a forged file
    emission_s = page.placement->delayed_s(emission_s);
    scale = page.placement->scale;
  }
  const Vec3 from_centre_m = Vec3(stored.position_m) - list.region.centre;
  const double path_s = scale * length(from_centre_m) / radiation_.speed_of_sound_mps();
  const auto delay_s = static_cast<float>(radiation_.emission_time_s(emitter, emission_s) + path_s);
  max_delay_s_ = std::max(max_delay_s_, delay_s);
  const std::size_t at = list.count++ % kCullBlock;
  if (at == 0) list.blocks.emplace_back().upper_bound.fill(-1);
  ShortlistBlock& block = list.blocks.back();
  block.upper_bound[at] = upper_bound;
  block.delay_s[at] = delay_s;
  block.signal[at] = page.maps.signal(page.map, radiation_.signal(stored));
  block.source[at] = static_cast<std::uint32_t>(index);
  block.mix[at] = page.sources.mix(index);
  SourceBound& bound = list.bounds.emplace_back(page.sources.bound(index));
  bound.position_m = Vec3f(from_centre_m);
  bound.boost = radiation_.late_boost().at(stored.delay_s);
}

// --- Testing lists ------------------------------------------------------------------------------

void PageShortlists::find_audible_entries(std::span<const Test> tests) {
  scratch_.occlusion.clear();
  std::size_t blocks = 0;
  for (const Test& test : tests) {
    const List& list = lists_[test.list];
    blocks += list.blocks.size();
    prefetch_to_read(list.blocks.data(),
                     std::min(list.blocks.size(), kPrefetchBlocks) * sizeof(ShortlistBlock));
    scratch_.occlusion.push_back(keyframe_.occlusion != nullptr
                                     ? keyframe_.occlusion->window(list.first)
                                     : OcclusionUpperBounds::Window());
    scratch_.occlusion.back().prefetch();
  }
  scratch_.audible.clear(kCullBlock * blocks);
  scratch_.ends.clear();
  for (std::size_t t = 0; t < tests.size(); ++t) {
    const List& list = lists_[tests[t].list];
    const auto threshold = static_cast<float>(tests[t].threshold * (1 - kThresholdSlack));
    std::size_t l = scratch_.audible.count;
    find_audible(list.blocks, threshold, loudness_, scratch_.occlusion[t], scratch_.audible);
    for (; l < scratch_.audible.count; ++l)
      __builtin_prefetch(&list.bounds[scratch_.audible.entry[l]]);
    scratch_.ends.push_back(scratch_.audible.count);
  }
}

void PageShortlists::bound_at_place(std::span<const Test> tests) {
  const std::size_t count = scratch_.audible.count;
  if (scratch_.here.size() < count + kCullBlock) {
    scratch_.here.resize(count + kCullBlock);
    scratch_.upper_bounds.resize(count + kCullBlock);
  }
  std::size_t l = 0;
  double error_m = 0;
  for (std::size_t t = 0; t < tests.size(); ++t) {
    error_m = std::max(error_m, tests[t].error_m);
    const List& list = lists_[tests[t].list];
    const Vec3f moved_m(tests[t].place - list.region.centre);
    for (; l < scratch_.ends[t]; ++l) {
      scratch_.here[l] = list.bounds[scratch_.audible.entry[l]];
      scratch_.here[l].position_m -= moved_m;
    }
  }
  upper_bounds_at(scratch_.here.data(), count, static_cast<float>(error_m + kShortlistError_m),
                  scratch_.upper_bounds.data());
}

}  // namespace clamor
