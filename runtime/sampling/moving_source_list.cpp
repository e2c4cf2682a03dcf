#include "runtime/sampling/moving_source_list.h"

#include <algorithm>
#include <cmath>

#include "common/directivity.h"
#include "common/random.h"
#include "formats/level/emitter.h"
#include "runtime/propagation/source_bound.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

// Factor on upper bounds of priorities that exceeds their rounding.
constexpr double kThresholdSlack = 1 - 1e-6;
// Squared distances are reduced by this fraction and this many m^2, more than single precision
// loses, as in source_page.cpp.
constexpr float kDistanceSlack = 0.001f;
constexpr std::size_t kBlock = 256;  // sources that are culled at a time
// Cells of the occlusion cache: an eighth of the distance, within limits.
constexpr double kCellPerDistance = 1.0 / 8, kMinCell_m = 0.5, kMaxCell_m = 8;
constexpr std::uint32_t kSeedOfU = 0x6d6f7665;

std::uint64_t number_of(std::size_t slot, std::uint32_t generation) {
  return kMovingSourceBit | std::uint64_t{generation & 0x7fffffffu} << 32 | slot;
}

std::size_t slot_of(std::uint64_t number) { return number & 0xffffffffu; }

// Hash of the cell that a source is in.
std::uint64_t cell_of(const Vec3f& position_m, const Vec3& place) {
  const double distance_m = length(Vec3(position_m) - place);
  const double size_m = std::exp2(
      std::round(std::log2(std::clamp(kCellPerDistance * distance_m, kMinCell_m, kMaxCell_m))));
  std::uint64_t cell = static_cast<std::uint64_t>(std::llround(16 * size_m));
  for (int axis = 0; axis < 3; ++axis) {
    cell *= 0x9e3779b97f4a7c15u;
    cell ^= static_cast<std::uint64_t>(
        std::llround(std::floor(static_cast<double>(position_m[axis]) / size_m)));
  }
  return cell * 0x9e3779b97f4a7c15u;
}

}  // namespace

MovingSourceList::Columns::Columns(std::size_t slots)
    : sources(slots),
      starts_s(slots),
      ends_s(slots, -kNeverEnds),
      versions(slots),
      generations(slots),
      x_m(slots),
      y_m(slots),
      z_m(slots),
      max_priority(slots, -1.0f),
      velocity_mps(slots),
      emission_of(slots) {}

MovingSourceList::MovingSourceList(MovingSources& sources, const RadiationModel& radiation,
                                   const SignalWeights& weights, std::span<const Emitter> emitters,
                                   std::size_t kinds)
    : moving_(sources),
      radiation_(radiation),
      weights_(weights),
      kinds_(emitters.last(kinds)),
      first_emitter_(static_cast<std::uint32_t>(emitters.size() - kinds)),
      columns_(sources.max_sources()),
      history_(sources.max_sources(), radiation.speed_of_sound_mps()) {}

std::uint64_t MovingSourceList::number(std::size_t slot) const {
  return number_of(slot, columns_.generations[slot]);
}

bool MovingSourceList::refresh() {
  // Signals in slots are not known to be steady.
  const bool may_change = weights_.slots != nullptr && moving_.now().count > 0;
  const bool dies_away = time_s_ && *time_s_ <= last_end_s_ + longest_s_;
  if (moving_.now().commits == newest_.number) return in_motion_ || may_change || dies_away;
  newest_.number = moving_.now().commits;
  newest_.is_unused = true;
  return true;
}

// Takes over a source's settings: it is an emitter of its kind.
void MovingSourceList::set(std::size_t slot, double time_s) {
  const MovingSources::Settings& settings = moving_.now().settings[slot];
  columns_.versions[slot] = settings.version;
  if (!settings.present) {
    columns_.max_priority[slot] = -1;
    // A source that was removed before any sample had it leaves nothing. Another may have been
    // here.
    if (columns_.generations[slot] != settings.generation)
      columns_.ends_s[slot] = -kNeverEnds;
    else if (columns_.ends_s[slot] == kNeverEnds)
      columns_.ends_s[slot] = last_end_s_ = time_s;
    return;
  }
  columns_.ends_s[slot] = kNeverEnds;
  Source& source = columns_.sources[slot];
  source.normal = source.mirror = settings.axis;
  const bool is_added = columns_.generations[slot] != settings.generation;
  if (!std::isnan(settings.start_s))
    columns_.starts_s[slot] = settings.start_s;
  else if (is_added)  // starts with the segment that ends with this keyframe
    columns_.starts_s[slot] = std::max(0.0, time_s - kKeyframe_s);
  source.emitter = first_emitter_ + settings.kind;
  source.is_emitter = true;
  const Bands& directivity = kinds_[settings.kind].directivity;
  for (std::size_t b = 0; b < kBandCount; ++b)
    source.power[b] = static_cast<float>(emission_power(static_cast<double>(directivity[b])) *
                                         static_cast<double>(settings.gain[b]) * settings.gain[b]);
  if (is_added) {
    columns_.generations[slot] = settings.generation;
    source.u = static_cast<float>(unit_above_zero(
        philox(kSeedOfU, {static_cast<std::uint32_t>(slot), settings.generation, 0, 0})[0]));
    added_.push_back(static_cast<std::uint32_t>(slot));
  }
  const RadiationModel::UpperBound bound =
      radiation_.upper_bound(source, weights_.max(radiation_.signal(source)));
  columns_.max_priority[slot] = static_cast<float>(static_cast<double>(bound.diffuse + bound.lobe) *
                                                   kFloatSlack / std::max(source.u, kMinU));
}

// Extrapolates all sources to a time, and records their paths.
void MovingSourceList::move_all(double time_s) {
  const std::size_t count = moving_.now().count;
  const bool extrapolates = std::abs(time_s - newest_.time_s) <= kMaxExtrapolation_s;
  const auto seconds = static_cast<float>(
      std::clamp(time_s - newest_.time_s, -kMaxExtrapolation_s, kMaxExtrapolation_s));
  const auto extrapolate = [&](const std::vector<float>& from_m, const std::vector<float>& by_mps,
                               std::vector<float>& to_m) {
    float max_mps = 0;
    for (std::size_t i = 0; i < count; ++i) {
      to_m[i] = from_m[i] + seconds * by_mps[i];
      max_mps = std::max(max_mps, std::abs(by_mps[i]));
    }
    return max_mps;
  };
  const float x = extrapolate(moving_.now().x_m, moving_.now().x_mps, columns_.x_m),
              y = extrapolate(moving_.now().y_m, moving_.now().y_mps, columns_.y_m),
              z = extrapolate(moving_.now().z_m, moving_.now().z_mps, columns_.z_m);
  const auto column = [count](const std::vector<float>& of) { return std::span(of).first(count); };
  history_.record(time_s, column(columns_.x_m), column(columns_.y_m), column(columns_.z_m));
  const auto restart = [&](std::uint32_t i) {
    history_.restart(i, extrapolates ? Vec3f(moving_.now().x_mps[i], moving_.now().y_mps[i],
                                             moving_.now().z_mps[i])
                                     : Vec3f(0));
  };
  for (const std::uint32_t i : history_.teleported()) restart(i);
  for (const std::uint32_t i : added_) restart(i);
  added_.clear();
  in_motion_ = std::max({x, y, z}) > 0 || !history_.settled();
}

// Ends what is left of removed sources whose signals are replaced.
void MovingSourceList::end_forgotten() {
  for (const std::uint32_t signal : forgotten_)
    for (std::size_t slot = 0; slot < moving_.now().count; ++slot)
      if (columns_.ends_s[slot] < kNeverEnds && this->signal(slot) == signal)
        columns_.ends_s[slot] = -kNeverEnds;
  forgotten_.clear();
}

void MovingSourceList::begin(const QueryKeyframe& keyframe) {
  SourcePool::begin(keyframe);
  const double time_s = keyframe.time_s;
  if (newest_.is_unused) {
    newest_.time_s = std::isnan(moving_.now().time_s) ? time_s : moving_.now().time_s;
    for (std::size_t i = 0; i < moving_.now().count; ++i)
      if (columns_.versions[i] != moving_.now().settings[i].version) set(i, time_s);
  }
  end_forgotten();
  if (newest_.is_unused || time_s_ != time_s) move_all(time_s);
  ++sample_;
  time_s_ = time_s;
  newest_.is_unused = false;
}

// Finds where a source was, and how fast, when the sound left it that the listener hears now.
void MovingSourceList::find_emission(std::size_t slot, const Vec3& listener_m) {
  if (columns_.emission_of[slot] == sample_) return;
  columns_.emission_of[slot] = sample_;
  const PositionHistory::Emission emission = history_.emission(slot, listener_m);
  columns_.sources[slot].position_m = emission.position_m;
  columns_.velocity_mps[slot] = emission.velocity_mps;
}

bool MovingSourceList::find_above(double threshold, std::size_t /*max_count*/,
                                  std::vector<FoundSource>& found) {
  const Vec3& place = keyframe().place_m();
  const std::size_t before = found.size();
  const Vec3f from(place);
  const auto min_priority = static_cast<float>(threshold * kThresholdSlack);
  constexpr auto kMinDistance2_m2 = static_cast<float>(kEmitterRadius_m * kEmitterRadius_m);
  for (std::size_t first = 0; first < moving_.now().count; first += kBlock) {
    const std::size_t count = std::min(kBlock, moving_.now().count - first);
    const float* const x = columns_.x_m.data() + first;
    const float* const y = columns_.y_m.data() + first;
    const float* const z = columns_.z_m.data() + first;
    const float* const max_priority = columns_.max_priority.data() + first;
    const float* const max_ratio2 = history_.max_distance_ratio2().data() + first;
    std::uint8_t passes[kBlock];
    std::uint8_t any = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const float dx = x[i] - from.x, dy = y[i] - from.y, dz = z[i] - from.z;
      const float r2_m2 = std::max(
          (dx * dx + dy * dy + dz * dz) * (1 - kDistanceSlack) - kDistanceSlack, kMinDistance2_m2);
      passes[i] = max_priority[i] * max_ratio2[i] >= min_priority * r2_m2;
      any |= passes[i];
    }
    if (any == 0) continue;
    for (std::size_t i = first; i < first + count; ++i) {
      if (passes[i - first] == 0) continue;
      find_emission(i, place);
      const Source& source = columns_.sources[i];
      const double r_m = std::max(length(place - Vec3(source.position_m)), source_radius_m(source));
      const std::uint64_t number = number_of(i, columns_.generations[i]);
      found.push_back({&source, number ^ (cell_of(source.position_m, place) & ~kMovingSourceBit),
                       radiation_.signal(source), 0, 1,
                       static_cast<double>(columns_.max_priority[i]) / (r_m * r_m), number,
                       columns_.velocity_mps[i], columns_.starts_s[i]});
    }
  }
  if (limits_.any()) apply_limits(place, before, found);
  spend(WorkBudget::kFound * (found.size() - before) +
        WorkBudget::kMovingPer16 * (moving_.max_sources() / 16));
  return true;
}

// Keeps the sources of highest priority of groups that are limited, by what is known of a priority
// without occlusion: its upper bound at the level of the moment.
void MovingSourceList::apply_limits(const Vec3& place, std::size_t first,
                                    std::vector<FoundSource>& found) {
  const auto group_of = [this](const FoundSource& one) {
    return moving_.now().settings[slot_of(one.voice)].group;
  };
  const auto priority_of = [&](const FoundSource& one) {
    const double distance_m = length(place - Vec3(one.source->position_m));
    return one.upper_bound *
           static_cast<double>(weights_at_distance(radiation_, weights_, one.signal, *one.source,
                                                   distance_m, time_s_.value_or(0) - one.start_s)
                                   .share);
  };
  limits_.begin();
  for (std::size_t i = first; i < found.size(); ++i)
    limits_.count(group_of(found[i]), priority_of(found[i]));
  limits_.end();
  const auto is_over_limit = [&](FoundSource& one) {
    const double threshold = limits_.threshold(group_of(one));
    if (threshold == 0) return false;
    const double priority = priority_of(one);
    one.min_scale = std::max(1.0, threshold / (priority * static_cast<double>(one.source->u)));
    return priority <= threshold;
  };
  const auto added = found.begin() + static_cast<std::ptrdiff_t>(first);
  found.erase(std::remove_if(added, found.end(), is_over_limit), found.end());
}

// Upper bound of the priority of a source, negative if there is none.
double MovingSourceList::upper_bound(std::size_t slot, const Vec3& place) const {
  const Vec3 away_m = place - place_m(slot);
  const double r2_m2 = std::max(dot(away_m, away_m), kEmitterRadius_m * kEmitterRadius_m);
  const float priority = columns_.max_priority[slot] * history_.max_distance_ratio2()[slot];
  return kFloatSlack * static_cast<double>(priority) / r2_m2;
}

double MovingSourceList::upper_bound() {
  double highest = 0;
  for (std::size_t i = 0; i < moving_.now().count; ++i)
    highest = std::max(highest, upper_bound(i, keyframe().place_m()));
  return highest;
}

double MovingSourceList::upper_bound_at_1m(std::size_t slot) const {
  const auto u = static_cast<double>(std::max(columns_.sources[slot].u, kMinU));
  const float priority = columns_.max_priority[slot] * history_.max_distance_ratio2()[slot];
  return std::max(0.0, kFloatSlack * u * static_cast<double>(priority));
}

double MovingSourceList::upper_bound_times_u(std::size_t slot, const Vec3& place) const {
  const auto u = static_cast<double>(std::max(columns_.sources[slot].u, kMinU));
  return std::max(0.0, u * upper_bound(slot, place));
}

MovingSourceList::Heard MovingSourceList::heard_at(std::size_t slot, const Vec3& place) const {
  const PositionHistory::Emission emission = history_.emission(slot, place);
  Heard heard{columns_.sources[slot], emission.velocity_mps, 0};
  heard.source.position_m = emission.position_m;
  heard.cell = cell_of(emission.position_m, place) & ~kMovingSourceBit;
  return heard;
}

}  // namespace clamor
