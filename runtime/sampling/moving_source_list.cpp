#include "runtime/sampling/moving_source_list.h"

#include <algorithm>
#include <cmath>

#include "common/directivity.h"
#include "common/random.h"
#include "formats/level/level.h"
#include "runtime/query/source_page.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

constexpr double kMovingSlack = 1.00001;
constexpr std::size_t kBlock = 256;  // sources that are sieved at a time
constexpr double kCellOfDistance = 1.0 / 8, kLeastCell_m = 0.5, kMostCell_m = 8;
constexpr std::uint32_t kSeedOfU = 0x6d6f7665;

std::uint64_t number_of(std::size_t place, std::uint32_t generation) {
  return kMovingSourceBit | std::uint64_t{generation & 0x7fffffffu} << 32 | place;
}

// Of the cell that a source is in, which is the larger the farther it is away.
std::uint64_t cell_of(const Vec3f& position_m, const Vec3& place) {
  const double distance_m = length(Vec3(position_m) - place);
  const double size_m = std::exp2(
      std::round(std::log2(std::clamp(kCellOfDistance * distance_m, kLeastCell_m, kMostCell_m))));
  std::uint64_t cell = static_cast<std::uint64_t>(std::llround(16 * size_m));
  for (int axis = 0; axis < 3; ++axis) {
    cell *= 0x9e3779b97f4a7c15u;
    cell ^= static_cast<std::uint64_t>(
        std::llround(std::floor(static_cast<double>(position_m[axis]) / size_m)));
  }
  return cell * 0x9e3779b97f4a7c15u;
}

}  // namespace

MovingSourceList::MovingSourceList(MovingSources& sources, const RadiationModel& field,
                                   std::span<const Bands> weights,
                                   std::span<const Emitter> emitters, std::size_t kinds)
    : sources_(sources),
      field_(field),
      weights_(weights),
      kinds_(emitters.last(kinds)),
      first_emitter_(static_cast<std::uint32_t>(emitters.size() - kinds)),
      heard_(sources.most()),
      versions_(sources.most()),
      generations_(sources.most()),
      highest_(sources.most(), -1.0f),
      velocity_mps_(sources.most()),
      found_in_(sources.most()),
      trails_(sources.most(), field.speed_of_sound_mps()) {
  for (auto* column : {&x_m_, &y_m_, &z_m_}) column->resize(sources.most());
}

bool MovingSourceList::refresh() {
  now_ = &sources_.latest();
  if (now_->commits == commits_) return in_motion_;
  commits_ = now_->commits;
  fresh_ = true;
  return true;
}

// A source like an emitter of its kind.
void MovingSourceList::tune(std::size_t place, double time_s) {
  const MovingSources::Tune& tune = now_->tunes[place];
  versions_[place] = tune.version;
  if (!tune.present) {
    highest_[place] = -1;
    return;
  }
  Source& source = heard_[place];
  source.normal = source.mirror = tune.axis;
  const bool is_new = generations_[place] != tune.generation;
  if (!std::isnan(tune.start_s))
    source.delay_s = static_cast<float>(tune.start_s);
  else if (is_new)  // with the segment that ends with this keyframe
    source.delay_s = static_cast<float>(std::max(0.0, time_s - kKeyframe_s));
  source.emitter = first_emitter_ + tune.kind;
  source.is_emitter = true;
  const Bands& directivity = kinds_[tune.kind].directivity;
  for (std::size_t b = 0; b < kBandCount; ++b)
    source.power[b] = static_cast<float>(emission_power(static_cast<double>(directivity[b])) *
                                         static_cast<double>(tune.gain[b]) * tune.gain[b]);
  if (is_new) {
    generations_[place] = tune.generation;
    source.u = static_cast<float>(unit_above_zero(
        philox(kSeedOfU, {static_cast<std::uint32_t>(place), tune.generation, 0, 0})[0]));
    restarts_.push_back(static_cast<std::uint32_t>(place));
  }
  const RadiationModel::Ceiling ceiling = field_.ceiling(source, weights_[field_.signal(source)]);
  highest_[place] = static_cast<float>(static_cast<double>(ceiling.diffuse + ceiling.lobe) *
                                       kMovingSlack / std::max(source.u, kMinU));
}

// Moves the sources to where they are at a time, and keeps the way that they came.
void MovingSourceList::put_all(double time_s) {
  const std::size_t count = now_->count;
  const bool coasts = std::abs(time_s - taken_s_) <= kMaxExtrapolation_s;
  const auto coast_s =
      static_cast<float>(std::clamp(time_s - taken_s_, -kMaxExtrapolation_s, kMaxExtrapolation_s));
  const auto put = [&](const std::vector<float>& from_m, const std::vector<float>& by_mps,
                       std::vector<float>& at_m) {
    float fastest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      at_m[i] = from_m[i] + coast_s * by_mps[i];
      fastest = std::max(fastest, std::abs(by_mps[i]));
    }
    return fastest;
  };
  const float x = put(now_->x_m, now_->x_mps, x_m_), y = put(now_->y_m, now_->y_mps, y_m_),
              z = put(now_->z_m, now_->z_mps, z_m_);
  const auto column = [count](const std::vector<float>& of) { return std::span(of).first(count); };
  trails_.record(time_s, column(x_m_), column(y_m_), column(z_m_));
  const auto restart = [&](std::uint32_t i) {
    trails_.restart(i, coasts ? Vec3f(now_->x_mps[i], now_->y_mps[i], now_->z_mps[i]) : Vec3f(0));
  };
  for (const std::uint32_t i : trails_.jumped()) restart(i);
  for (const std::uint32_t i : restarts_) restart(i);
  restarts_.clear();
  in_motion_ = std::max({x, y, z}) > 0 || !trails_.settled();
}

void MovingSourceList::begin(const Vec3& /*place*/, double time_s) {
  if (now_ == nullptr) now_ = &sources_.latest();
  if (fresh_) {
    taken_s_ = std::isnan(now_->time_s) ? time_s : now_->time_s;
    for (std::size_t i = 0; i < now_->count; ++i)
      if (versions_[i] != now_->tunes[i].version) tune(i, time_s);
  }
  if (fresh_ || time_s_ != time_s) put_all(time_s);
  ++begun_;
  time_s_ = time_s;
  fresh_ = false;
}

// Where the source was, and how fast, when what the listener hears of it now left it.
void MovingSourceList::find_emission(std::size_t place, const Vec3& listener_m) {
  if (found_in_[place] == begun_) return;
  found_in_[place] = begun_;
  const PositionHistory::Emission emission = trails_.emission(place, listener_m);
  heard_[place].position_m = emission.position_m;
  velocity_mps_[place] = emission.velocity_mps;
}

void MovingSourceList::look(const Vec3& place, double threshold, std::vector<FoundSource>& found) {
  const Vec3f from(place);
  const auto least = static_cast<float>(threshold * (1 - 1e-6));
  constexpr float kGive = 0.001f;  // as in source_page.cpp
  constexpr auto kLeast2_m2 = static_cast<float>(kEmitterRadius_m * kEmitterRadius_m);
  for (std::size_t first = 0; first < now_->count; first += kBlock) {
    const std::size_t count = std::min(kBlock, now_->count - first);
    const float* const x = x_m_.data() + first;
    const float* const y = y_m_.data() + first;
    const float* const z = z_m_.data() + first;
    const float* const highest = highest_.data() + first;
    const float* const nearer = trails_.nearer().data() + first;
    std::uint8_t passes[kBlock];
    std::uint8_t any = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const float dx = x[i] - from.x, dy = y[i] - from.y, dz = z[i] - from.z;
      const float r2_m2 = std::max((dx * dx + dy * dy + dz * dz) * (1 - kGive) - kGive, kLeast2_m2);
      passes[i] = highest[i] * nearer[i] >= least * r2_m2;
      any |= passes[i];
    }
    if (any == 0) continue;
    for (std::size_t i = first; i < first + count; ++i) {
      if (passes[i - first] == 0) continue;
      find_emission(i, place);
      const Source& source = heard_[i];
      const double r_m = std::max(length(place - Vec3(source.position_m)), source_radius_m(source));
      const std::uint64_t number = number_of(i, generations_[i]);
      found.push_back({&source, number ^ (cell_of(source.position_m, place) & ~kMovingSourceBit),
                       field_.signal(source), 0, 1, static_cast<double>(highest_[i]) / (r_m * r_m),
                       number, velocity_mps_[i]});
    }
  }
}

double MovingSourceList::highest(const Vec3& place) const {
  double most = 0;
  if (now_ == nullptr) return 0;
  for (std::size_t i = 0; i < now_->count; ++i) {
    const Vec3 away(place.x - x_m_[i], place.y - y_m_[i], place.z - z_m_[i]);
    const double r2_m2 = std::max(dot(away, away), kEmitterRadius_m * kEmitterRadius_m);
    most = std::max(most, static_cast<double>(highest_[i] * trails_.nearer()[i]) / r2_m2);
  }
  return most * kMovingSlack;
}

bool CombinedPool::look(const Vec3& place, double threshold, std::size_t most,
                        std::vector<FoundSource>& found) {
  if (!still_.look(place, threshold, most, found)) return false;
  const std::size_t before = found.size();
  moving_.look(place, threshold, found);
  spend(WorkBudget::kFound * (found.size() - before) +
        WorkBudget::kMovingPer16 * (moving_.most() / 16));
  // Whoever looks for all of them cannot do with fewer.
  return found.size() <= most || threshold == 0;
}

double CombinedPool::highest(const Vec3& place) {
  return std::max(still_.highest(place), moving_.highest(place));
}

}  // namespace clamor
