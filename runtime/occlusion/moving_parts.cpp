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

void MovingParts::mark_changed(std::size_t slot) {
  ++parts_[slot].version;
  ++version_;
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
  std::uint32_t slot = static_cast<std::uint32_t>(parts_.size());
  if (free_.empty()) {
    parts_.emplace_back();
    handles_.push_back(0);
  } else {
    slot = free_.back();
    free_.pop_back();
  }
  ++present_;
  Part& part = parts_[slot];
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
  if (parts_[handle.slot].pose == unit) return {};
  parts_[handle.slot].pose = unit;
  mark_changed(handle.slot);
  return {};
}

Result<void> MovingParts::enable(PartHandle handle, bool enabled) {
  if (!is_present(handle)) return gone();
  if (parts_[handle.slot].enabled == enabled) return {};
  parts_[handle.slot].enabled = enabled;
  mark_changed(handle.slot);
  return {};
}

Result<void> MovingParts::remove(PartHandle handle) {
  if (!is_present(handle)) return gone();
  parts_[handle.slot].shape = nullptr;
  mark_changed(handle.slot);
  ++handles_[handle.slot];
  free_.push_back(handle.slot);
  --present_;
  return {};
}

}  // namespace clamor
