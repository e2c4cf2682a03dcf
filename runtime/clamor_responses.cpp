// clamor_responses.cpp: impulse responses through the C interface.
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/bake_file/level_extent.h"
#include "formats/bake_file/mesh_at_rest.h"
#include "runtime/clamor.h"
#include "runtime/clamor_context.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/response/energy_response.h"
#include "runtime/response/impulse_response.h"

using clamor::interface::fail;
using clamor::interface::guarded;
using clamor::interface::is_missing;
using clamor::interface::kMaxPosition_m;

extern "C" clamor_result clamor_measure_responses(clamor_context* context, clamor_level level,
                                                  uint32_t emitter, const double* positions_m,
                                                  uint32_t places, float* samples, uint64_t frames,
                                                  uint64_t* whole_frames, clamor_error* error) {
  return guarded(error, [&]() -> clamor_result {
    constexpr std::uint32_t kAll = 0xffffffff;
    constexpr std::uint64_t kMaxFrames = std::uint64_t{1} << 30;
    if (is_missing(context) || positions_m == nullptr || samples == nullptr || frames > kMaxFrames)
      return fail(error, CLAMOR_ERROR_ARGUMENT);
    for (std::size_t i = 0; i < std::size_t{3} * places; ++i)
      if (!(std::abs(positions_m[i]) <= kMaxPosition_m)) return fail(error, CLAMOR_ERROR_ARGUMENT);
    const auto file = context->world.level(level);
    if (file == nullptr) return fail(error, CLAMOR_ERROR_HANDLE);
    if (emitter != kAll && emitter >= file->emitters().size())
      return fail(error, CLAMOR_ERROR_ARGUMENT, "the level has no such emitter");
    auto all = clamor::read_expanded_sources(*file);
    if (!all.ok()) return fail(error, CLAMOR_ERROR_FILE, all.error().message);
    for (clamor::Source& source : all->sources) source.emitter = all->stored_as[source.emitter];
    const auto mesh = clamor::read_mesh_at_rest(*file);
    if (!mesh.ok()) return fail(error, CLAMOR_ERROR_FILE, mesh.error().message);
    const clamor::OcclusionGeometry surfaces(*mesh, file->materials(), all->sources);
    const clamor::LevelExtent extent(*file, *mesh);
    std::size_t longest = 0, outside = 0;
    for (std::uint32_t i = 0; i < places; ++i) {
      const double* const at = positions_m + std::size_t{3} * i;
      const clamor::Vec3 place_m(at[0], at[1], at[2]);
      if (const auto complaint = extent.complaint("the receiver", place_m);
          complaint && context->report && outside++ == 0)
        context->report((file->path() + ": " + *complaint).c_str());
      const auto arrivals = clamor::energy_response(
          all->sources, file->emitters(), file->materials(), file->settings().air,
          place_m - file->origin_m(),
          emitter == kAll ? std::nullopt : std::optional<std::uint32_t>(emitter), &surfaces);
      longest = std::max(longest, clamor::first_response_frame(arrivals) +
                                      clamor::whole_response_frames(arrivals));
      clamor::write_impulse_response(arrivals, 0,
                                     {samples + frames * i, static_cast<std::size_t>(frames)});
    }
    if (whole_frames != nullptr) *whole_frames = longest;
    return CLAMOR_OK;
  });
}
