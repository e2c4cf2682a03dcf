#include "runtime/world/part_mirror.h"

#include "runtime/engine/auralizer.h"
#include "runtime/occlusion/part_shape.h"

namespace clamor {

void PartMirror::take_over(std::span<const WorldParts::Committed> committed) {
  MovingParts* const parts = auralizer_.parts();
  if (parts == nullptr) return;
  if (slots_.size() < committed.size()) slots_.resize(committed.size());
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    Slot& slot = slots_[i];
    const std::uint64_t handle = i < committed.size() ? committed[i].handle : 0;
    if (slot.handle != handle) {
      // A level's part whose level is closed stays as it is.
      if (slot.is_added) (void)parts->remove(slot.part);
      slot = {};
    }
    if (handle != 0 && slot.version != committed[i].version) take_over(committed[i], slot);
  }
}

void PartMirror::take_over(const WorldParts::Committed& committed, Slot& slot) {
  MovingParts& parts = *auralizer_.parts();
  const WorldPart& part = committed.part;
  const bool is_new = slot.handle == 0, is_here = part.level == 0 || part.level == level_;
  if (is_new && is_here && part.is_added()) {
    const auto added = parts.add(part.shape, part.pose);
    slot.is_added = added.ok();
    if (added.ok()) slot.part = *added;
  } else if (is_new && is_here && part.index < auralizer_.level_parts().size()) {
    slot.part = auralizer_.level_parts()[part.index];
  }
  if (slot.part.generation != 0) {
    (void)parts.move(slot.part, part.pose);
    (void)parts.enable(slot.part, part.enabled);
  }
  // Last, so that an exception does not lose the change.
  slot.handle = committed.handle;
  slot.version = committed.version;
}

}  // namespace clamor
