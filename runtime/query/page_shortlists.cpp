#include "runtime/query/page_shortlists.h"

#include <algorithm>
#include <limits>

namespace clamor {

using namespace query;

namespace {

constexpr std::size_t kMinSlots = 1 << 10;

}  // namespace

PageShortlists::PageShortlists(const RadiationModel& field, const SignalWeights& weights)
    : field_(field), weights_(weights), slots_(kMinSlots) {}

void PageShortlists::begin(const Vec3& place, double time_s, double max_share, double until_s) {
  const bool is_earlier = time_s < now_.time_s;
  now_ = {place, place - now_.place, time_s, max_share, until_s};
  if (++keyframe_ % kListLifetime_keyframes == 0 || is_earlier) drop_lists(is_earlier);
  const double error_s = (kMaxListRadius_m + 1e-3) / field_.speed_of_sound_mps() + kDelayError_s;
  loudness_.tabulate(weights_.tracks, time_s, max_delay_s_, static_cast<float>(error_s));
}

// All, or those that were not used for long.
void PageShortlists::drop_lists(bool all) {
  const auto dropped = std::erase_if(lists_, [&](const List& list) {
    return all || keyframe_ - list.used > kListLifetime_keyframes;
  });
  if (dropped == 0) return;
  rehash(kMinSlots);
  ++numbering_;
}

std::uint32_t PageShortlists::list_of(std::uint64_t first) {
  if (2 * (lists_.size() + 1) > slots_.size()) rehash(2 * slots_.size());
  for (std::size_t at = fibonacci_hash(first);; ++at) {
    std::uint32_t& slot = slots_[at & (slots_.size() - 1)];
    if (slot == 0) {
      lists_.emplace_back(&memory_).first = first;
      slot = static_cast<std::uint32_t>(lists_.size());
    }
    if (List& list = lists_[slot - 1]; list.first == first) {
      list.used = keyframe_;
      return slot - 1;
    }
  }
}

void PageShortlists::rehash(std::size_t size) {
  while (size < 4 * lists_.size()) size *= 2;
  slots_.assign(size, 0);
  for (std::size_t l = 0; l < lists_.size(); ++l) {
    std::size_t at = fibonacci_hash(lists_[l].first);
    while (slots_[at & (size - 1)] != 0) ++at;
    slots_[at & (size - 1)] = static_cast<std::uint32_t>(l + 1);
  }
}

std::size_t PageShortlists::use(std::uint32_t list) {
  lists_[list].used = keyframe_;
  work_ += lists_[list].count / 4;
  return lists_[list].count;
}

// --- Making a list ------------------------------------------------------------------------------

// A listener who walks on reaches the centre of the ball first, and then its far side.
Vec3 PageShortlists::centre_ahead(const ShortlistPage& page, double radius_m) const {
  const double step_m = length(now_.step_m);
  if (!(step_m > 0)) return page.query.centre;
  Vec3 ahead = now_.step_m / step_m;
  if (page.placement != nullptr) ahead = glm::transpose(page.placement->rotation) * ahead;
  return page.query.centre + kListLead * radius_m * ahead;
}

// A list for a listener who leaves its ball with the next step or two holds here and now only.
ValidityRegion PageShortlists::region_for(const ShortlistPage& page) const {
  const Vec3 low(page.bounds.low_m), high(page.bounds.high_m), place = page.query.centre;
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  const double distance_m = length(glm::max(glm::max(low - place, place - high), Vec3(0)));
  const double radius_m = std::clamp(kListRadiusPerDistance * distance_m, kMinListRadius_m / scale,
                                     kMaxListRadius_m / scale);
  if (!keeps_ || 2 * length(now_.step_m) / scale >= radius_m)
    return {place, 0, (keeps_ ? kListThreshold : 1) * page.query.threshold};
  return {centre_ahead(page, radius_m), radius_m,
          kListThreshold * thresholds_.share() * page.query.threshold};
}

std::size_t PageShortlists::renew(std::uint32_t index, const ShortlistPage& page) {
  List& list = lists_[index];
  list.region = region_for(page);
  list.used = keyframe_;
  list.count = 0;
  list.blocks.clear();
  list.shapes.clear();
  // Where all signals are quiet for a while, few sources pass; but the list ends with that while.
  const bool all_quiet = now_.max_share < kQuietShare;
  if (all_quiet) list.region.until_s = now_.until_s;
  const Vec3 low(page.bounds.low_m), high(page.bounds.high_m), place = page.query.centre;
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  const double distance_m = length(glm::max(glm::max(low - place, place - high), Vec3(0)));
  const std::size_t tested = page.sources.cull(
      list.region.centre, list.region.threshold / (all_quiet ? now_.max_share : 1),
      [&](std::size_t source, double upper_bound, const CullRecord& record) {
        add(list, page, source, static_cast<float>(upper_bound), record);
      },
      CullMargin{list.region.radius_m + page.error_m, std::max(distance_m, 1 / scale)});
  // Positions and directions lie elsewhere in memory, and are on their way by now.
  for (std::size_t s = 0; s < list.count; ++s) {
    const Source& stored = page.sources[list.blocks[s / kCullBlock].source[s % kCullBlock]];
    SourceShape& shape = list.shapes[s];
    shape.position_m = Vec3f(Vec3(stored.position_m) - list.region.centre);
    shape.normal = stored.normal;
    shape.mirror = stored.mirror;
  }
  work_ += WorkBudget::kCulledSource * tested + WorkBudget::kListedSource * list.count;
  return tested;
}

void PageShortlists::add(List& list, const ShortlistPage& page, std::size_t index,
                         float upper_bound, const CullRecord& record) {
  std::uint32_t emitter = record.emitter;
  float emission_s = record.delay_s;
  double scale = 1;
  if (page.placement != nullptr) {
    emitter += page.placement->emitters;
    if (emitter >= field_.emitter_count()) return;  // of a forged file
    emission_s = page.placement->delayed_s(emission_s);
    scale = page.placement->scale;
  }
  const double path_s =
      scale * length(list.region.centre - record.position_m) / field_.speed_of_sound_mps();
  const auto delay_s = static_cast<float>(field_.emission_time_s(emitter, emission_s) + path_s);
  max_delay_s_ = std::max(max_delay_s_, delay_s);
  page.sources.prefetch(index);
  const std::size_t at = list.count++ % kCullBlock;
  if (at == 0) list.blocks.emplace_back().upper_bound.fill(-1);
  ShortlistBlock& block = list.blocks.back();
  block.upper_bound[at] = upper_bound;
  block.delay_s[at] = delay_s;
  block.signal[at] = page.maps.signal(page.map, field_.signal(record.emitter));
  block.source[at] = static_cast<std::uint32_t>(index);
  block.mix[at] = record.mix;
  SourceShape& shape = list.shapes.emplace_back();
  shape.radius2_m2 = record.radius2_m2;
  shape.diffuse = record.diffuse;
  shape.lobe = record.lobe;
  shape.fall = record.fall;
  shape.bounce = record.bounce;
  shape.slope = record.slope;
  shape.boost = field_.late_boost().at(record.delay_s);
}

// --- Testing lists ------------------------------------------------------------------------------

void PageShortlists::find_loud(std::span<const Test> tests) {
  scratch_.near.clear();
  std::size_t blocks = 0;
  for (const Test& test : tests) {
    const List& list = lists_[test.list];
    blocks += list.blocks.size();
    prefetch_to_read(list.blocks.data(),
                     std::min(list.blocks.size(), kPrefetchBlocks) * sizeof(ShortlistBlock));
    scratch_.near.push_back(occlusion_ != nullptr ? occlusion_->window(list.first)
                                                  : OcclusionUpperBounds::Window());
    scratch_.near.back().prefetch();
  }
  scratch_.loud.make_room(kCullBlock * blocks);
  scratch_.ends.clear();
  std::size_t count = 0;
  for (std::size_t t = 0; t < tests.size(); ++t) {
    const List& list = lists_[tests[t].list];
    const auto threshold = static_cast<float>(tests[t].threshold * (1 - kThresholdSlack));
    const std::size_t before = count;
    count += find_audible(list.blocks, threshold, loudness_, scratch_.near[t],
                          scratch_.loud.from(before));
    for (std::size_t l = before; l < count; ++l)
      __builtin_prefetch(&list.shapes[scratch_.loud.entry[l]]);
    scratch_.ends.push_back(count);
  }
}

void PageShortlists::bound_at_place(std::span<const Test> tests) {
  const std::size_t count = scratch_.ends.empty() ? 0 : scratch_.ends.back();
  if (scratch_.here.size() < count) {
    scratch_.here.resize(count);
    scratch_.bounds.resize(count);
  }
  std::size_t l = 0;
  double error_m = 0;
  for (std::size_t t = 0; t < tests.size(); ++t) {
    error_m = std::max(error_m, tests[t].error_m);
    const List& list = lists_[tests[t].list];
    const Vec3f moved_m(tests[t].place - list.region.centre);
    for (; l < scratch_.ends[t]; ++l) {
      scratch_.here[l] = list.shapes[scratch_.loud.entry[l]];
      scratch_.here[l].position_m -= moved_m;
    }
  }
  upper_bounds_at(std::span(scratch_.here).first(count),
                  static_cast<float>(error_m + kShortlistError_m), scratch_.bounds.data());
}

}  // namespace clamor
