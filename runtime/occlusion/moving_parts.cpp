#include "runtime/occlusion/moving_parts.h"

#include <string>
#include <utility>

#include "formats/level/level_origin.h"
#include "runtime/occlusion/part_shape.h"

namespace clamor {

namespace {

Error gone() { return Error("there is no such movable part; it was removed, or never added."); }

}  // namespace

bool MovingParts::is_present(PartHandle handle) const {
  return handle.slot < handles_.size() && handle.generation % 2 == 1 &&
         handles_[handle.slot] == handle.generation;
}

// Notes that all copies need the slot before they are read again.
void MovingParts::mark_changed(std::size_t slot) {
  ++own_.parts[slot].version;
  has_changed_ = true;
  for (unsigned copy = 0; copy < copies_.size(); ++copy) {
    if ((stale_in_[slot] & (1u << copy)) != 0) continue;
    stale_in_[slot] = static_cast<std::uint8_t>(stale_in_[slot] | (1u << copy));
    stale_[copy].push_back(static_cast<std::uint32_t>(slot));
  }
}

PartPose MovingParts::in_level(PartPose pose) const {
  pose.position_m = clamor::in_level(pose.position_m, origin_m_);
  return pose;
}

Result<PartHandle> MovingParts::add(std::shared_ptr<const PartShape> shape, const PartPose& given) {
  const PartPose pose = in_level(given);
  if (const auto ok = check(pose); !ok.ok()) return ok.error();
  if (present_ == kMaxMovableParts)
    return Error("there are " + std::to_string(kMaxMovableParts) +
                 " movable parts already. Remove some, or join those that move together.");
  std::uint32_t slot = static_cast<std::uint32_t>(own_.parts.size());
  if (free_.empty()) {
    own_.parts.emplace_back();
    handles_.push_back(0);
    stale_in_.push_back(0);
  } else {
    slot = free_.back();
    free_.pop_back();
  }
  ++present_;
  Part& part = own_.parts[slot];
  part.shape = std::move(shape);
  part.pose = normalized(pose);
  part.enabled = true;
  mark_changed(slot);
  return PartHandle{slot, ++handles_[slot]};
}

Result<void> MovingParts::move(PartHandle handle, const PartPose& given) {
  if (!is_present(handle)) return gone();
  const PartPose pose = in_level(given);
  if (const auto ok = check(pose); !ok.ok()) return ok;
  const PartPose unit = normalized(pose);
  if (own_.parts[handle.slot].pose == unit) return {};
  own_.parts[handle.slot].pose = unit;
  mark_changed(handle.slot);
  return {};
}

Result<void> MovingParts::enable(PartHandle handle, bool enabled) {
  if (!is_present(handle)) return gone();
  if (own_.parts[handle.slot].enabled == enabled) return {};
  own_.parts[handle.slot].enabled = enabled;
  mark_changed(handle.slot);
  return {};
}

Result<void> MovingParts::remove(PartHandle handle) {
  if (!is_present(handle)) return gone();
  own_.parts[handle.slot].shape = nullptr;
  mark_changed(handle.slot);
  ++handles_[handle.slot];
  free_.push_back(handle.slot);
  --present_;
  return {};
}

void MovingParts::commit() {
  if (!has_changed_) return;
  has_changed_ = false;
  Snapshot& copy = copies_[writing_];
  copy.parts.resize(own_.parts.size());
  for (const std::uint32_t slot : stale_[writing_]) {
    copy.parts[slot] = own_.parts[slot];
    stale_in_[slot] = static_cast<std::uint8_t>(stale_in_[slot] & ~(1u << writing_));
  }
  stale_[writing_].clear();
  copy.commits = ++own_.commits;
  writing_ = middle_.exchange(writing_ | kFresh, std::memory_order_acq_rel) & kCopy;
}

const MovingParts::Snapshot& MovingParts::latest() noexcept {
  if (has_pending_commit())
    reading_ = middle_.exchange(reading_, std::memory_order_acq_rel) & kCopy;
  return copies_[reading_];
}

}  // namespace clamor
