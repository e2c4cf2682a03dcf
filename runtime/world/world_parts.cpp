#include "runtime/world/world_parts.h"

namespace clamor {

WorldParts::WorldParts(std::uint64_t tag) : parts_(kMaxMovableParts, tag) {}

std::uint64_t WorldParts::add(WorldPart part) {
  has_changed_ = true;
  return parts_.insert(std::make_shared<Part>(Part{std::move(part)}));
}

std::uint64_t WorldParts::of_level(std::uint64_t level, std::uint32_t index,
                                   const MovablePart& part, const Vec3& origin_m) {
  if (const auto known = of_levels_.find({level, index}); known != of_levels_.end())
    return known->second;
  const std::uint64_t handle =
      add({level, index, nullptr, part.name.c_str(), part.mesh.triangles.size(),
           in_world(part.rest_pose, origin_m)});
  if (handle != 0) of_levels_[{level, index}] = handle;
  return handle;
}

std::optional<WorldPart> WorldParts::find(std::uint64_t handle) const {
  const auto part = parts_.find(handle);
  return part == nullptr ? std::nullopt : std::optional(part->now);
}

bool WorldParts::move(std::uint64_t handle, const PartPose& pose) {
  const auto part = parts_.find(handle);
  if (part == nullptr) return false;
  if (part->now.pose == pose) return true;
  part->now.pose = pose;
  ++part->version;
  return has_changed_ = true;
}

bool WorldParts::enable(std::uint64_t handle, bool enabled) {
  const auto part = parts_.find(handle);
  if (part == nullptr) return false;
  part->now.enabled = enabled;
  ++part->version;
  return has_changed_ = true;
}

bool WorldParts::remove(std::uint64_t handle) {
  if (parts_.remove(handle) == nullptr) return false;
  return has_changed_ = true;
}

void WorldParts::forget_level(std::uint64_t level) {
  const auto first = of_levels_.lower_bound({level, 0});
  auto last = first;
  for (; last != of_levels_.end() && last->first.first == level; ++last) remove(last->second);
  of_levels_.erase(first, last);
}

void WorldParts::commit(std::vector<Committed>& committed) {
  if (!has_changed_) return;
  std::vector<bool> is_present(committed.size());
  parts_.for_each_handle([&](std::uint64_t handle) {
    const std::size_t slot = HandleTable<Part>::slot_number(handle);
    const auto part = parts_.find(handle);
    if (slot >= committed.size()) {
      committed.resize(slot + 1);
      is_present.resize(slot + 1);
    }
    is_present[slot] = true;
    Committed& last = committed[slot];
    if (last.handle != handle || last.version != part->version)
      last = {handle, part->version, part->now};
  });
  for (std::size_t slot = 0; slot < committed.size(); ++slot)
    if (!is_present[slot]) committed[slot] = {};
  has_changed_ = false;
}

}  // namespace clamor
