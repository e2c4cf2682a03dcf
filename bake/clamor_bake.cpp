#include "bake/clamor_bake.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "bake/application_level.h"
#include "bake/bake_request.h"
#include "bake/clamor_bake_calls.h"
#include "common/c_structures.h"
#include "common/sample_rate.h"
#include "formats/level/material_presets.h"

struct clamor_bake_level {
  clamor::ApplicationLevel level;
};

const clamor::ApplicationLevel& clamor::level_of(const clamor_bake_level& level) {
  return level.level;
}

namespace {

using clamor::ApplicationLevel;
using clamor::Bands;
using clamor::copy_from_caller;
using clamor::copy_to_caller;
using clamor::fail;
using clamor::guarded;
using clamor::refuse;
using clamor::Result;
using clamor::size_refusal;
using clamor::text_of;

static_assert(CLAMOR_BAKE_BANDS == clamor::kBandCount);

constexpr std::uint32_t kMinRate_hz = 1000, kMaxRate_hz = 768'000;  // as for sound files

std::optional<std::string> optional_text(const char* text) {
  return text != nullptr ? std::optional<std::string>(text) : std::nullopt;
}

std::optional<Bands> optional_bands(const float* values) {
  if (values == nullptr) return std::nullopt;
  Bands bands;
  std::copy_n(values, bands.size(), bands.begin());
  return bands;
}

clamor::Vec3 vector_of(const double (&values)[3]) { return {values[0], values[1], values[2]}; }

// Writes the number of what was added, or why it was not.
clamor_bake_result finish(const Result<std::uint32_t>& added, std::uint32_t* number,
                          clamor_bake_result code, clamor_bake_error* error) {
  if (!added.ok()) return fail(error, code, added.error().message);
  *number = *added;
  return CLAMOR_BAKE_OK;
}

}  // namespace

extern "C" {

const char* clamor_bake_result_text(clamor_bake_result result) {
  switch (result) {
    case CLAMOR_BAKE_OK:
      return "no error";
    case CLAMOR_BAKE_ERROR_ARGUMENT:
      return "an argument is null, not finite or out of range, or a structure's bytes is not its "
             "size";
    case CLAMOR_BAKE_ERROR_FILE:
      return "a file cannot be read or written, or is damaged";
    case CLAMOR_BAKE_ERROR_MEMORY:
      return "there is not enough memory";
    case CLAMOR_BAKE_ERROR_INTERNAL:
      return "a fault of the library";
    case CLAMOR_BAKE_ERROR_LEVEL:
      return "the level cannot be baked";
    case CLAMOR_BAKE_ERROR_CANCELLED:
      return "the bake was cancelled, and nothing was written";
    case CLAMOR_BAKE_ERROR_WARNINGS:
      return "there were warnings, and strict is set";
    default:
      return "an unknown code";
  }
}

uint32_t clamor_bake_version(void) {
  return CLAMOR_BAKE_VERSION_MAJOR << 16 | CLAMOR_BAKE_VERSION_MINOR << 8 |
         CLAMOR_BAKE_VERSION_PATCH;
}

uint32_t clamor_bake_abi_version(void) { return CLAMOR_BAKE_ABI_VERSION; }

clamor_bake_result clamor_bake_read_level(const char* path,
                                          const clamor_bake_level_options* options,
                                          clamor_bake_level** level, clamor_bake_error* error) {
  return guarded(error, [&] {
    if (level != nullptr) *level = nullptr;
    clamor_bake_level_options chosen;
    if (path == nullptr || level == nullptr || !copy_from_caller(options, chosen) ||
        (chosen.emitters == nullptr && chosen.emitter_count > 0))
      return refuse(error, size_refusal(options));
    clamor::ImportOptions import;
    import.hidden_meshes = chosen.hidden_meshes != 0;
    import.sidecar = optional_text(chosen.acoustics);
    import.material = optional_text(chosen.material);
    for (std::uint64_t i = 0; i < chosen.emitter_count; ++i)
      import.emitters.push_back(text_of(chosen.emitters[i]));
    clamor::BakeRequest request;
    request.import = import;
    if (const auto wrong = request.complaint()) return refuse(error, *wrong);
    auto read = ApplicationLevel::read(path, import);
    if (!read.ok()) return fail(error, CLAMOR_BAKE_ERROR_FILE, read.error().message);
    *level = new clamor_bake_level{std::move(*read)};
    return clamor_bake_result{CLAMOR_BAKE_OK};
  });
}

clamor_bake_result clamor_bake_create_level(const char* name, clamor_bake_level** level,
                                            clamor_bake_error* error) {
  return guarded(error, [&] {
    if (level == nullptr) return fail(error, CLAMOR_BAKE_ERROR_ARGUMENT);
    *level = nullptr;
    *level = new clamor_bake_level{ApplicationLevel(name != nullptr ? name : "level")};
    return clamor_bake_result{CLAMOR_BAKE_OK};
  });
}

void clamor_bake_destroy_level(clamor_bake_level* level) { delete level; }

clamor_bake_result clamor_bake_add_material(clamor_bake_level* level,
                                            const clamor_bake_material* values, uint32_t* material,
                                            clamor_bake_error* error) {
  return guarded(error, [&] {
    clamor_bake_material given;
    if (level == nullptr || values == nullptr || material == nullptr ||
        !copy_from_caller(values, given))
      return refuse(error, size_refusal(values));
    const auto added = level->level.add_material(
        {text_of(given.name), text_of(given.preset), optional_bands(given.absorption),
         optional_bands(given.scattering), optional_bands(given.phong),
         optional_bands(given.transmission)});
    return finish(added, material, CLAMOR_BAKE_ERROR_ARGUMENT, error);
  });
}

const char* clamor_bake_preset_name(uint32_t index) {
  try {
    const auto& names = clamor::MaterialPresets::built_in().names();
    return index < names.size() ? names[index].c_str() : nullptr;
  } catch (...) {
    return nullptr;
  }
}

clamor_bake_result clamor_bake_add_triangles(clamor_bake_level* level, const float* vertices_m,
                                             uint64_t vertex_count, const uint32_t* indices,
                                             uint64_t triangle_count, uint32_t material,
                                             clamor_bake_error* error) {
  return guarded(error, [&] {
    constexpr std::uint64_t kMost = UINT32_MAX;
    if (level == nullptr || vertex_count > kMost || triangle_count > kMost ||
        (vertices_m == nullptr && vertex_count > 0))
      return fail(error, CLAMOR_BAKE_ERROR_ARGUMENT);
    if (indices == nullptr && triangle_count > vertex_count / 3)
      return refuse(error, "without indices, a triangle takes three vertices");
    if (triangle_count == 0) return clamor_bake_result{CLAMOR_BAKE_OK};
    if (indices == nullptr) vertex_count = 3 * triangle_count;
    const auto added = level->level.add_triangles(
        {vertices_m, 3 * static_cast<std::size_t>(vertex_count)},
        {indices, indices != nullptr ? 3 * static_cast<std::size_t>(triangle_count) : 0}, material);
    return added.ok() ? CLAMOR_BAKE_OK : refuse(error, added.error().message);
  });
}

clamor_bake_result clamor_bake_add_sound(clamor_bake_level* level, const clamor_bake_sound* values,
                                         uint32_t* sound, clamor_bake_error* error) {
  return guarded(error, [&] {
    clamor_bake_sound given;
    if (level == nullptr || values == nullptr || sound == nullptr ||
        !copy_from_caller(values, given))
      return refuse(error, size_refusal(values));
    if ((given.path != nullptr) == (given.samples != nullptr))
      return refuse(error, "a sound has either a path or samples");
    const bool loop = given.plays_once == 0;
    if (given.path != nullptr)
      return finish(level->level.add_sound_file(given.path, text_of(given.name), loop), sound,
                    CLAMOR_BAKE_ERROR_FILE, error);
    if (given.rate_hz == 0) given.rate_hz = clamor::kSampleRate_hz;
    if (given.rate_hz < kMinRate_hz || given.rate_hz > kMaxRate_hz)
      return refuse(error, "rate_hz must lie between 1000 and 768000");
    if (given.frames == 0 || given.frames > UINT32_MAX)
      return refuse(error, "a sound has samples, for 30 minutes at most");
    return finish(level->level.add_samples({given.samples, static_cast<std::size_t>(given.frames)},
                                           static_cast<int>(given.rate_hz),
                                           given.name != nullptr ? given.name : "sound", loop),
                  sound, CLAMOR_BAKE_ERROR_ARGUMENT, error);
  });
}

clamor_bake_result clamor_bake_add_emitter(clamor_bake_level* level,
                                           const clamor_bake_emitter* values,
                                           clamor_bake_error* error) {
  return guarded(error, [&] {
    clamor_bake_emitter given;
    if (level == nullptr || values == nullptr || !copy_from_caller(values, given))
      return refuse(error, size_refusal(values));
    clamor::Emitter emitter;
    emitter.name = text_of(given.name);
    emitter.position_m = vector_of(given.position_m);
    const bool faces = std::any_of(given.facing, given.facing + 3, [](double v) { return v != 0; });
    if (faces) emitter.axis = vector_of(given.facing);
    if (given.gain != 0) emitter.gain = given.gain;
    emitter.directivity =
        optional_bands(given.directivity_bands)
            .value_or(clamor::same_in_all_bands(static_cast<float>(given.directivity)));
    emitter.signal = given.sound;
    emitter.delay_s = given.delay_s;
    const auto added = level->level.add_emitter(std::move(emitter));
    return added.ok() ? CLAMOR_BAKE_OK : refuse(error, added.error().message);
  });
}

clamor_bake_result clamor_bake_set_air(clamor_bake_level* level, const clamor_bake_air* air,
                                       clamor_bake_error* error) {
  return guarded(error, [&] {
    clamor_bake_air given;
    if (level == nullptr || air == nullptr || !copy_from_caller(air, given))
      return refuse(error, size_refusal(air));
    const auto set =
        level->level.set_air({given.temperature_c, given.humidity_percent, given.pressure_kpa});
    return set.ok() ? CLAMOR_BAKE_OK : refuse(error, set.error().message);
  });
}

clamor_bake_result clamor_bake_get_level_info(const clamor_bake_level* level,
                                              clamor_bake_level_info* info) {
  return guarded(nullptr, [&]() -> clamor_bake_result {
    if (level == nullptr) return CLAMOR_BAKE_ERROR_ARGUMENT;
    const ApplicationLevel& asked = level->level;
    clamor_bake_level_info filled{};
    filled.materials = static_cast<std::uint32_t>(asked.materials());
    filled.sounds = static_cast<std::uint32_t>(asked.sounds());
    filled.emitters = static_cast<std::uint32_t>(asked.emitters());
    filled.triangles = asked.triangles();
    const auto bounds = asked.bounds();
    for (int i = 0; i < 3; ++i) {
      filled.low_m[i] = bounds.low_m[i];
      filled.high_m[i] = bounds.high_m[i];
    }
    return copy_to_caller(filled, info) ? CLAMOR_BAKE_OK : CLAMOR_BAKE_ERROR_ARGUMENT;
  });
}

}  // extern "C"
