// clamor_parts.cpp: movable parts in the C interface.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "common/c_structures.h"
#include "common/material.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/level_origin.h"
#include "formats/level/movable_part.h"
#include "runtime/clamor.h"
#include "runtime/clamor_context.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/world/world_parts.h"
#include "runtime/world/world_sources.h"

namespace {

using clamor::Mesh;
using clamor::MovablePart;
using clamor::PartPose;
using clamor::WorldPart;
using clamor::WorldParts;
using clamor::interface::fail;
using clamor::interface::guarded;
using clamor::interface::hand_out;
using clamor::interface::is_missing;

constexpr double kMinHalf_m = 0.001, kMaxHalf_m = 10'000;

bool read_part_pose(clamor_pose given, bool zeros_are_identity, PartPose& pose) {
  const auto& q = given.orientation;
  if (zeros_are_identity && q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0)
    given.orientation[3] = 1;
  clamor::Quaternion rotation;
  if (!clamor::interface::read_pose(given, clamor::kMaxWorldCoordinate_m, pose.position_m,
                                    rotation))
    return false;
  pose.rotation = clamor::Rotation(glm::normalize(rotation));
  return true;
}

clamor_pose pose_of(const PartPose& pose) {
  const auto& [position_m, q, scale] = pose;
  return {{position_m.x, position_m.y, position_m.z}, {q.x, q.y, q.z, q.w}};
}

// The triangles of a box or a mesh; none if the numbers are wrong.
Mesh mesh_of(const clamor_part_options& options) {
  const double(&half)[3] = options.half_extents_m;
  if (half[0] != 0 || half[1] != 0 || half[2] != 0) {
    for (const double extent : half)
      if (!(extent >= kMinHalf_m && extent <= kMaxHalf_m)) return {};
    return clamor::box_mesh({half[0], half[1], half[2]}, 0);
  }
  Mesh mesh;
  if (options.vertices_m == nullptr || options.indices == nullptr ||
      options.triangles > clamor::kMaxMovableTriangles ||
      options.vertices > 3 * clamor::kMaxMovableTriangles)
    return mesh;
  for (std::size_t i = 0; i < options.vertices; ++i) {
    const float* const at = options.vertices_m + 3 * i;
    mesh.vertices_m.emplace_back(at[0], at[1], at[2]);
  }
  for (std::size_t i = 0; i < options.triangles; ++i) {
    const std::uint32_t* const corners = options.indices + 3 * i;
    mesh.triangles.push_back({corners[0], corners[1], corners[2]});
  }
  mesh.materials.assign(mesh.triangles.size(), 0);
  return mesh;
}

clamor::Result<clamor::Material> material_of(const clamor_part_options& options) {
  const auto is_zero = [](double share) { return share == 0; };
  const bool has_absorption = !std::ranges::all_of(options.absorption, is_zero);
  clamor::Material material = clamor::mirror_material();
  for (std::size_t b = 0; b < clamor::kBandCount; ++b) {
    for (const double share :
         {options.transmission[b], options.absorption[b], options.scattering[b]})
      if (!(share >= 0 && share <= 1))
        return clamor::Error("a part transmits, absorbs and scatters shares from 0 to 1");
    material.transmission[b] = static_cast<float>(options.transmission[b]);
    if (has_absorption) material.absorption[b] = static_cast<float>(options.absorption[b]);
    material.absorption[b] = std::max(material.absorption[b], material.transmission[b]);
    material.scattering[b] = static_cast<float>(options.scattering[b]);
  }
  return material;
}

// Calls act(parts) with the movable parts of a context.
template <class Act>
clamor_result with_parts(clamor_context* context, const Act& act) noexcept {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    return context->world.sources().with_parts(act);
  });
}

// Hands out the handle of a part of a level, which choose(parts) names by its number.
template <class Choose>
clamor_result level_part(clamor_context* context, clamor_level level, clamor_part* part,
                         const Choose& choose) noexcept {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context) || part == nullptr) return CLAMOR_ERROR_ARGUMENT;
    clamor_result result = CLAMOR_ERROR_HANDLE;
    context->world.with_level(level, [&](const clamor::BakeFile& file) {
      const std::vector<MovablePart>& parts = file.movable_parts();
      std::size_t number = 0;
      result = choose(parts, number);
      if (result != CLAMOR_OK) return;
      const auto handle = context->world.sources().with_parts([&](WorldParts& all) {
        return all.of_level(level, static_cast<std::uint32_t>(number), parts[number],
                            file.origin_m());
      });
      result = hand_out(handle, part);
    });
    return result;
  });
}

}  // namespace

extern "C" {

clamor_result clamor_get_level_part(clamor_context* context, clamor_level level, uint32_t number,
                                    clamor_part* part) {
  return level_part(context, level, part,
                    [number](const std::vector<MovablePart>& parts, std::size_t& chosen) {
                      chosen = number;
                      return number < parts.size() ? clamor_result{CLAMOR_OK}
                                                   : clamor_result{CLAMOR_ERROR_ARGUMENT};
                    });
}

clamor_result clamor_find_part(clamor_context* context, clamor_level level, const char* name,
                               clamor_part* part) {
  if (name == nullptr) return CLAMOR_ERROR_ARGUMENT;
  return level_part(
      context, level, part, [name](const std::vector<MovablePart>& parts, std::size_t& chosen) {
        const auto found = std::find_if(parts.begin(), parts.end(), [name](const MovablePart& one) {
          return one.name == name;
        });
        chosen = static_cast<std::size_t>(found - parts.begin());
        return found != parts.end() ? clamor_result{CLAMOR_OK}
                                    : clamor_result{CLAMOR_ERROR_NOT_FOUND};
      });
}

clamor_result clamor_get_part_info(clamor_context* context, clamor_part part,
                                   clamor_part_info* info) {
  return with_parts(context, [&](WorldParts& parts) -> clamor_result {
    const auto found = parts.find(part);
    if (!found) return CLAMOR_ERROR_HANDLE;
    clamor_part_info filled{};
    filled.triangles = static_cast<uint32_t>(found->triangles);
    filled.level = found->level;
    filled.pose = pose_of(found->pose);
    filled.is_disabled = found->enabled ? 0 : 1;
    filled.name = found->name;
    return clamor::copy_to_caller(filled, info) ? CLAMOR_OK
                                                : clamor::interface::refuse(context, info);
  });
}

clamor_result clamor_add_part(clamor_context* context, const clamor_part_options* options,
                              clamor_part* part, clamor_error* error) {
  return guarded(error, [&]() -> clamor_result {
    clamor_part_options chosen;
    WorldPart added;
    if (is_missing(context) || part == nullptr || options == nullptr ||
        !clamor::copy_from_caller(options, chosen) ||
        !read_part_pose(chosen.pose, true, added.pose))
      return fail(error, CLAMOR_ERROR_ARGUMENT, clamor::size_refusal(options));
    const auto material = material_of(chosen);
    if (!material.ok()) return fail(error, CLAMOR_ERROR_ARGUMENT, material.error().message);
    if (chosen.level != 0 && context->world.level(chosen.level) == nullptr)
      return fail(error, CLAMOR_ERROR_HANDLE);
    const auto shape = clamor::PartShape::make(mesh_of(chosen), std::span(&*material, 1));
    if (!shape.ok()) return fail(error, CLAMOR_ERROR_ARGUMENT, shape.error().message);
    added.level = chosen.level;
    added.shape = *shape;
    added.triangles = added.shape->triangles();
    added.enabled = chosen.is_disabled == 0;
    const auto handle = context->world.sources().with_parts(
        [&](WorldParts& parts) { return parts.add(std::move(added)); });
    return hand_out(handle, part, error);
  });
}

clamor_result clamor_move_part(clamor_context* context, clamor_part part, const clamor_pose* pose) {
  PartPose moved;
  if (pose == nullptr || !read_part_pose(*pose, false, moved)) return CLAMOR_ERROR_ARGUMENT;
  return with_parts(context, [&](WorldParts& parts) -> clamor_result {
    const auto found = parts.find(part);
    if (!found) return CLAMOR_ERROR_HANDLE;
    moved.scale = found->pose.scale;
    return parts.move(part, moved) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_enable_part(clamor_context* context, clamor_part part, uint32_t enabled) {
  return with_parts(context, [&](WorldParts& parts) -> clamor_result {
    return parts.enable(part, enabled != 0) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

clamor_result clamor_remove_part(clamor_context* context, clamor_part part) {
  return with_parts(context, [&](WorldParts& parts) -> clamor_result {
    const auto found = parts.find(part);
    if (!found) return CLAMOR_ERROR_HANDLE;
    if (!found->is_added()) return CLAMOR_ERROR_STATE;
    return parts.remove(part) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

}  // extern "C"
