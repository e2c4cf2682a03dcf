#include "runtime/occlusion/part_scene.h"

#include <algorithm>
#include <array>
#include <utility>

#include "formats/level/embree_instances.h"
#include "runtime/occlusion/packet_rays.h"

namespace clamor {

namespace {

PartBounds bounds_of(const PartShape& shape, const Matrix& axes, const Vec3& position_m) {
  const Vec3 low(shape.bounds().low_m), high(shape.bounds().high_m);
  const Vec3 centre_m = position_m + axes * (0.5 * (low + high));
  const Vec3 half_m = 0.5 * (high - low);
  const Vec3 reach_m =
      half_m.x * glm::abs(axes[0]) + half_m.y * glm::abs(axes[1]) + half_m.z * glm::abs(axes[2]);
  return {Vec3f(centre_m - reach_m), Vec3f(centre_m + reach_m)};
}

EmbreeInstances::Transform transform_of(const Matrix& axes, const Vec3& position_m) {
  EmbreeInstances::Transform transform;
  for (glm::length_t row = 0; row < 3; ++row) {
    for (glm::length_t column = 0; column < 3; ++column)
      transform[static_cast<std::size_t>(3 * column + row)] = static_cast<float>(axes[column][row]);
    transform[static_cast<std::size_t>(9 + row)] = static_cast<float>(position_m[row]);
  }
  return transform;
}

}  // namespace

PartScene::PartScene() = default;
PartScene::~PartScene() = default;

// If memory runs out, the part is absent.
void PartScene::take_over(std::size_t slot, const MovingParts::Part& from) {
  Part& part = parts_[slot];
  part.version = from.version;
  const auto before = std::exchange(part.shape, nullptr);
  if (before != nullptr) {
    --present_;
    transmitting_ -= before->transmits() ? 1 : 0;
    changed_.push_back(part.bounds);
  }
  if (from.shape == nullptr || !from.enabled) {
    if (before != nullptr) instances_->remove(slot);
    return;
  }
  part.axes = from.pose.scale * glm::mat3_cast(Quaternion(from.pose.rotation));
  part.position_m = from.pose.position_m;
  part.scale = from.pose.scale;
  if (instances_ == nullptr) instances_ = std::make_unique<EmbreeInstances>();
  const auto transform = transform_of(part.axes, part.position_m);
  if (before == from.shape)
    instances_->move(slot, transform);
  else
    instances_->set(slot, from.shape->bvh(), transform);
  part.bounds = bounds_of(*from.shape, part.axes, part.position_m);
  changed_.push_back(part.bounds);
  part.shape = from.shape;
  ++present_;
  transmitting_ += part.shape->transmits() ? 1 : 0;
}

std::span<const PartBounds> PartScene::update(const MovingParts& moved) {
  changed_.clear();
  if (is_up_to_date(moved)) return {};
  taken_ = moved.version();
  const std::span<const MovingParts::Part> parts = moved.parts();
  parts_.resize(parts.size());
  for (std::size_t slot = 0; slot < parts_.size(); ++slot)
    if (parts_[slot].version != parts[slot].version) take_over(slot, parts[slot]);
  if (!changed_.empty()) {
    instances_->update();
    ++version_;
  }
  return changed_;
}

void PartScene::add_faces(std::size_t slot, std::vector<PartShape::Face>& faces) const {
  const Part& part = parts_[slot];
  if (part.shape == nullptr) return;
  for (const PartShape::Face& local : part.shape->faces()) {
    PartShape::Face& face = faces.emplace_back(local);
    face.normal = part.axes * local.normal / part.scale;
    face.offset_m = part.scale * local.offset_m + dot(face.normal, part.position_m);
    face.centre_m = part.position_m + part.axes * local.centre_m;
    face.radius_m *= part.scale;
    face.area_m2 *= part.scale * part.scale;
  }
}

std::optional<PartScene::Hit> PartScene::first_hit(const Vec3f& from_m, const Vec3f& to_m,
                                                   float near, float far) const {
  if (empty()) return std::nullopt;
  const RTCRayHit ray = instances_->first_hit(from_m, to_m - from_m, near, far);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{ray.ray.tfar, ray.hit.instID[0], ray.hit.primID};
}

bool PartScene::is_free(const Vec3f& from_m, const Vec3f& to_m) const {
  return empty() || !instances_->is_occluded(from_m, to_m);
}

void PartScene::find_edges(const Vec3& from_m, const Vec3& to_m, std::size_t count,
                           double longest_m, std::vector<EdgeBetween>& found) const {
  const double straight_m = length(to_m - from_m);
  for (const Part& part : parts_) {
    if (part.shape == nullptr) continue;
    if (distance_m(from_m, part.bounds) + distance_m(to_m, part.bounds) > straight_m + longest_m)
      continue;
    const Matrix turn = part.axes / part.scale;
    const auto to_part = [&](const Vec3& point_m) {
      return glm::transpose(turn) * (point_m - part.position_m) / part.scale;
    };
    const std::size_t before = found.size();
    part.shape->edges().find_nearest(to_part(from_m), to_part(to_m), count, longest_m / part.scale,
                                     found);
    const auto to_world = [&](Vec3f& point_m) {
      point_m = Vec3f(part.position_m + part.axes * Vec3(point_m));
    };
    for (std::size_t i = before; i < found.size(); ++i) {
      DiffractingEdge& edge = found[i].edge;
      found[i].detour_m *= part.scale;
      edge.width_m *= static_cast<float>(part.scale);
      to_world(edge.from_m);
      to_world(edge.to_m);
      for (Vec3f* axis : {&edge.along, &edge.face, &edge.air}) *axis = Vec3f(turn * Vec3(*axis));
    }
    const auto is_shorter = [](const EdgeBetween& a, const EdgeBetween& b) {
      return a.detour_m < b.detour_m;
    };
    std::inplace_merge(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(before),
                       found.end(), is_shorter);
    if (found.size() > count) found.resize(count);
  }
}

void PartScene::first_hits(std::span<const PathSegment, kPacketRays> segments, std::uint32_t lanes,
                           std::span<float, kPacketRays> fractions,
                           std::span<std::optional<OccluderPlane>, kPacketRays> surfaces) const {
  if (empty()) return;
  PacketRays packet(segments, lanes);
  for (std::size_t l = 0; l < kPacketRays; ++l) packet.rays.ray.tfar[l] = fractions[l];
  instances_->first_hits(packet.valid.data(), packet.rays);
  for (std::size_t l = 0; l < kPacketRays; ++l)
    if (packet.has_hit(l))
      surfaces[l] = plane(packet.rays.hit.instID[0][l], packet.rays.hit.primID[l]);
}

// A plane n x = d of the part becomes (R n) x = s d + (R n) t with the rotation R, the scale s and
// the translation t.
OccluderPlane PartScene::plane(std::uint32_t p, std::uint32_t triangle) const {
  const Part& part = parts_[p];
  const OccluderPlane& local = part.shape->plane(triangle);
  const Vec3 normal = part.axes * Vec3(local.normal) / part.scale;
  return {Vec3f(normal), static_cast<float>(part.scale * static_cast<double>(local.offset_m) +
                                            dot(normal, part.position_m))};
}

const Bands& PartScene::transmission(const Hit& hit) const {
  return parts_[hit.part].shape->transmission(hit.triangle);
}

const Bands& PartScene::mirrored(const Hit& hit) const {
  return parts_[hit.part].shape->mirrored(hit.triangle);
}

}  // namespace clamor
