// clamor_portals.cpp: the portals of a level in the C interface.
#include <algorithm>
#include <memory>

#include "common/c_structures.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/baked_portals.h"
#include "runtime/clamor.h"
#include "runtime/clamor_context.h"

namespace {

using clamor::BakeFile;
using clamor::Portal;
using clamor::Vec3;
using clamor::interface::in_level;

void put(const Vec3& vector, double (&into)[3]) {
  for (int axis = 0; axis < 3; ++axis) into[axis] = vector[axis];
}

}  // namespace

static_assert(CLAMOR_PORTAL_BY_PARTS == static_cast<double>(clamor::kOpenedByParts));

extern "C" {

clamor_result clamor_get_portal_info(clamor_context* context, clamor_level level, uint32_t portal,
                                     clamor_portal_info* info) {
  return in_level(context, level, [&](const BakeFile& file) -> clamor_result {
    if (portal >= file.portals().portals.size()) return CLAMOR_ERROR_ARGUMENT;
    const Portal& asked = file.portals().portals[portal];
    clamor_portal_info filled{};
    put(asked.centre_m + file.origin_m(), filled.centre_m);
    put(asked.half_u_m, filled.half_u_m);
    put(asked.half_v_m, filled.half_v_m);
    filled.name = asked.name.c_str();
    return clamor::copy_to_caller(filled, info) ? CLAMOR_OK
                                                : clamor::interface::refuse(context, info);
  });
}

clamor_result clamor_find_portal(clamor_context* context, clamor_level level, const char* name,
                                 uint32_t* portal) {
  return in_level(context, level, [&](const BakeFile& file) -> clamor_result {
    if (name == nullptr || portal == nullptr) return CLAMOR_ERROR_ARGUMENT;
    const auto& portals = file.portals().portals;
    const auto found = std::find_if(portals.begin(), portals.end(),
                                    [name](const Portal& one) { return one.name == name; });
    if (found == portals.end()) return CLAMOR_ERROR_NOT_FOUND;
    *portal = static_cast<uint32_t>(found - portals.begin());
    return CLAMOR_OK;
  });
}

clamor_result clamor_set_portal(clamor_context* context, clamor_level level, uint32_t portal,
                                double openness) {
  return in_level(context, level, [&](const BakeFile& file) -> clamor_result {
    if (portal >= file.portals().portals.size() ||
        !((openness >= 0 && openness <= 1) || openness == CLAMOR_PORTAL_BY_PARTS))
      return CLAMOR_ERROR_ARGUMENT;
    return context->world.set_portal(level, portal, openness) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

}  // extern "C"
