// clamor_emitters.cpp: the emitters of a level in the C interface.
#include <algorithm>
#include <memory>

#include "common/c_structures.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/emitter.h"
#include "runtime/clamor.h"
#include "runtime/clamor_context.h"
#include "runtime/world/world_sources.h"

namespace {

using clamor::BakeFile;
using clamor::Emitter;
using clamor::WorldEmitter;
using clamor::interface::in_level;
using clamor::interface::refuse;

}  // namespace

extern "C" {

clamor_result clamor_get_emitter_info(clamor_context* context, clamor_level level, uint32_t emitter,
                                      clamor_emitter_info* info) {
  return in_level(context, level, [&](const BakeFile& file) -> clamor_result {
    if (emitter >= file.emitters().size()) return CLAMOR_ERROR_ARGUMENT;
    const Emitter& asked = file.emitters()[emitter];
    clamor_emitter_info filled{};
    filled.sound = asked.signal;
    const clamor::Vec3 place_m = asked.position_m + file.origin_m();
    filled.position_m[0] = place_m.x;
    filled.position_m[1] = place_m.y;
    filled.position_m[2] = place_m.z;
    filled.gain = asked.gain;
    filled.name = asked.name.c_str();
    return clamor::copy_to_caller(filled, info) ? CLAMOR_OK : refuse(context, info);
  });
}

clamor_result clamor_find_emitter(clamor_context* context, clamor_level level, const char* name,
                                  uint32_t* emitter) {
  return in_level(context, level, [&](const BakeFile& file) -> clamor_result {
    if (name == nullptr || emitter == nullptr) return CLAMOR_ERROR_ARGUMENT;
    const auto& emitters = file.emitters();
    const auto found = std::find_if(emitters.begin(), emitters.end(),
                                    [name](const Emitter& one) { return one.name == name; });
    if (found == emitters.end()) return CLAMOR_ERROR_NOT_FOUND;
    *emitter = static_cast<uint32_t>(found - emitters.begin());
    return CLAMOR_OK;
  });
}

clamor_result clamor_change_emitter(clamor_context* context, clamor_level level, uint32_t emitter,
                                    const clamor_emitter_options* options) {
  return in_level(context, level, [&](const BakeFile& file) -> clamor_result {
    clamor_emitter_options chosen;
    if (options == nullptr || !clamor::copy_from_caller(options, chosen))
      return refuse(context, options);
    if (chosen.has_gain == 0) chosen.gain = 1;
    if (emitter >= file.emitters().size() || !(chosen.gain >= 0 && chosen.gain <= 1))
      return CLAMOR_ERROR_ARGUMENT;
    if (chosen.group != 0 && !context->world.sources().has_group(chosen.group))
      return CLAMOR_ERROR_HANDLE;
    const WorldEmitter changed{chosen.is_muted != 0 ? 0 : chosen.gain, chosen.group};
    return context->world.change_emitter(level, emitter, changed) ? CLAMOR_OK : CLAMOR_ERROR_HANDLE;
  });
}

}  // extern "C"
