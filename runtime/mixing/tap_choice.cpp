#include "runtime/mixing/tap_choice.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace clamor {

std::int64_t field_start_frames(double begins_frames, bool is_live) {
  const std::int64_t step = is_live ? kKeyframeFrames : kFieldStart_frames;
  const double steps = std::floor(begins_frames / static_cast<double>(step) + 1e-6);
  return static_cast<std::int64_t>(steps) * step + (is_live ? kLiveLead_frames : 0);
}

std::int64_t field_start_frames(const SampledSource& source, double emission_frames,
                                const PlayableSignals& signals) {
  const double begins_frames =
      emission_frames - static_cast<double>(source.source->delay_s) * kSampleRate_hz;
  return field_start_frames(begins_frames, signals[source.signal].is_live());
}

bool TapChoice::may_be_tap(const SampledSource& one, double arrival_frames, double now_frames,
                           bool was_tap) const {
  if (!one.moves) return true;
  if (one.velocity_mps != Vec3f(0)) return false;
  if (was_tap || arrival_frames < now_frames - kBegan_frames) return true;
  const PreparedSignal& signal = signals_[one.signal];
  return arrival_frames > now_frames + kBegins_frames && (!signal.loops() || signal.is_live());
}

// Those with enough members, and no more than there may be inputs.
void TapChoice::choose_groups() {
  counts_.clear();
  for (auto& [group, members] : groups_) {
    const auto partitions = static_cast<std::size_t>(
        2 + (members.last_frames - members.first_frames) / kKeyframeFrames);
    members.is_worth_it = members.count * (members.was_worth_it ? 2 : 1) >= min_taps_ * partitions;
    if (members.is_worth_it) counts_.push_back(members.count);
  }
  if (counts_.size() <= kMaxFieldInputs) return;
  std::ranges::nth_element(counts_, counts_.begin() + kMaxFieldInputs, std::greater<>());
  for (auto& [group, members] : groups_)
    members.is_worth_it = members.is_worth_it && members.count > counts_[kMaxFieldInputs];
}

std::span<const std::uint64_t> TapChoice::voices(std::span<const SampledSource> sample,
                                                 const Listener& listener, double now_frames,
                                                 std::span<const std::uint64_t> voices_before) {
  std::erase_if(groups_, [](const auto& one) { return one.second.count == 0; });
  for (auto& [group, members] : groups_) members = {.was_worth_it = members.is_worth_it};
  const double frames_per_m = kSampleRate_hz / radiation_.speed_of_sound_mps();
  members_.clear();
  numbers_.clear();
  auto last = last_sample_.begin();
  auto voice = voices_before.begin();
  for (const SampledSource& one : sample) {
    while (last != last_sample_.end() && *last < one.number) ++last;
    while (voice != voices_before.end() && *voice < one.number) ++voice;
    const bool was_tap = last != last_sample_.end() && *last == one.number &&
                         (voice == voices_before.end() || *voice != one.number);
    numbers_.push_back(one.number);
    members_.push_back(nullptr);
    const double emission_frames =
        (one.start_s + radiation_.emission_time_s(*one.source)) * kSampleRate_hz;
    const double arrival_frames =
        emission_frames + frames_per_m * length(listener.position_m - Vec3(one.source->position_m));
    if (!may_be_tap(one, arrival_frames, now_frames, was_tap)) continue;
    const std::int64_t start_frames = field_start_frames(one, emission_frames, signals_);
    const double delay_frames = arrival_frames - static_cast<double>(start_frames);
    if (delay_frames < kKeyframeFrames / 2) continue;
    Members& members = groups_[{one.signal, start_frames}];
    const bool is_first = members.count++ == 0;
    members.first_frames = is_first ? delay_frames : std::min(members.first_frames, delay_frames);
    members.last_frames = std::max(members.last_frames, delay_frames);
    members_.back() = &members;
  }
  choose_groups();
  std::swap(last_sample_, numbers_);
  voices_.clear();
  for (std::size_t i = 0; i < sample.size(); ++i)
    if (members_[i] == nullptr || !members_[i]->is_worth_it) voices_.push_back(sample[i].number);
  return voices_;
}

}  // namespace clamor
