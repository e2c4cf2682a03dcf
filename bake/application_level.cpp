#include "bake/application_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "common/sample_rate.h"
#include "common/utf8_path.h"
#include "formats/audio/audio_file.h"
#include "formats/audio/wav_header.h"
#include "formats/gltf/gltf_mesh.h"
#include "formats/level/emitter_spec.h"
#include "formats/level/level_origin.h"
#include "formats/level/level_places.h"
#include "formats/level/material_presets.h"
#include "formats/level/signal_table.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxMaterials = 65'534;
constexpr double kMaxPhong = kMirrorExponent;
constexpr std::uint64_t kMaxSound_s = 30 * 60;

Result<void> check_bands(const std::optional<Bands>& bands, const char* what, double high) {
  if (!bands) return {};
  for (const float value : *bands)
    if (!(value >= 0 && value <= high))
      return Error(fmt::format("{} is {:g} but must be from 0 to {:g}", what, value, high));
  return {};
}

Result<void> check(const ApplicationMaterial& values) {
  for (const auto& [bands, what, high] : {std::tuple(&values.absorption, "absorption", 1.0),
                                          std::tuple(&values.scattering, "scattering", 1.0),
                                          std::tuple(&values.phong, "phong", kMaxPhong),
                                          std::tuple(&values.transmission, "transmission", 1.0)})
    if (auto ok = check_bands(*bands, what, high); !ok.ok()) return ok;
  return {};
}

double area_m2(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Vec3 a(mesh.vertices_m[triangle[0]]), b(mesh.vertices_m[triangle[1]]),
      c(mesh.vertices_m[triangle[2]]);
  return length(cross(b - a, c - a)) / 2;
}

template <class T>
void hash_list(InputHash& hash, const std::vector<T>& list) {
  hash.add(std::as_bytes(std::span(list)));
}

}  // namespace

ApplicationLevel::ApplicationLevel(std::string name) : folder_("") {
  file_.level.name = std::move(name);
}

Result<ApplicationLevel> ApplicationLevel::read(const std::string& path,
                                                const ImportOptions& options) {
  auto imported = import_level(path, options);
  if (!imported.ok()) return imported.error();
  ApplicationLevel level("");
  level.path_ = path;
  level.options_ = options;
  level.file_ = std::move(*imported);
  level.added_.air = level.file_.level.air;
  return level;
}

Result<std::uint32_t> ApplicationLevel::add_material(const ApplicationMaterial& values) {
  Material material;
  if (!values.preset.empty()) {
    auto preset = MaterialPresets::built_in().get(values.preset);
    if (!preset.ok()) return preset.error();
    material = std::move(*preset);
    if (material.name.empty()) material.name = values.preset;
  } else if (!values.absorption) {
    return Error("the material has neither a preset nor an absorption; give one of them");
  } else if (values.phong) {
    material.scattering = Bands{};
  }
  if (!values.name.empty()) material.name = values.name;
  if (const auto ok = check(values); !ok.ok()) return ok.error().in(in_quotes(material.name));
  material.absorption = values.absorption.value_or(material.absorption);
  material.scattering = values.scattering.value_or(material.scattering);
  material.phong = values.phong.value_or(material.phong);
  material.transmission = values.transmission.value_or(material.transmission);
  if (!conserves_energy(material))
    return Error(in_quotes(material.name) +
                 " transmits more than it absorbs, where absorption is all that it does not "
                 "reflect; lower its transmission");
  if (materials() >= kMaxMaterials) return Error("a level has at most 65534 materials");
  added_.materials.push_back(std::move(material));
  changed_ = true;
  return static_cast<std::uint32_t>(added_.materials.size() - 1);
}

Result<void> ApplicationLevel::add_triangles(std::span<const float> vertices_m,
                                             std::span<const std::uint32_t> indices,
                                             std::uint32_t material) {
  const std::size_t vertices = vertices_m.size() / 3;
  const std::size_t count = (indices.empty() ? vertices : indices.size()) / 3;
  if (material >= added_.materials.size())
    return Error(fmt::format("there is no material {}; add it first", material));
  if (triangles() + count > kMaxTriangles ||
      file_.level.mesh.vertices_m.size() + added_.mesh.vertices_m.size() + vertices >
          std::numeric_limits<std::uint32_t>::max())
    return Error(fmt::format("a level has at most {} triangles", kMaxTriangles));
  for (std::size_t i = 0; i < vertices_m.size(); ++i)
    if (!(std::abs(vertices_m[i]) <= static_cast<float>(kMaxWorldCoordinate_m)))
      return Error(fmt::format(
          "vertex {} is not finite, or is more than 100 000 km from the origin", i / 3));
  for (std::size_t i = 0; i < indices.size(); ++i)
    if (indices[i] >= vertices)
      return Error(fmt::format("triangle {} has index {}, but there are {} vertices", i / 3,
                               indices[i], vertices));

  Mesh& mesh = added_.mesh;
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  for (std::size_t v = 0; v < vertices; ++v)
    mesh.vertices_m.emplace_back(vertices_m[3 * v], vertices_m[3 * v + 1], vertices_m[3 * v + 2]);
  for (std::size_t t = 0; t < count; ++t) {
    std::array<std::uint32_t, 3> triangle;
    for (std::size_t c = 0; c < 3; ++c)
      triangle[c] =
          first + (indices.empty() ? static_cast<std::uint32_t>(3 * t + c) : indices[3 * t + c]);
    if (area_m2(mesh, triangle) == 0) {
      ++without_area_;
      continue;
    }
    mesh.triangles.push_back(triangle);
    mesh.materials.push_back(static_cast<std::uint16_t>(material));
  }
  changed_ = true;
  return {};
}

Result<std::uint32_t> ApplicationLevel::add_sound_file(const std::string& path, std::string name,
                                                       bool loop) {
  Signal signal{std::move(name), {}, loop};
  if (is_built_in_signal(path)) {
    signal.samples = built_in_signal(path);
  } else {
    const auto bytes = folder_.read_anywhere(path);
    if (!bytes.ok()) return bytes.error();
    auto samples = decode_audio(*bytes, path);
    if (!samples.ok()) return samples.error();
    signal.samples = std::move(*samples);
  }
  if (signal.name.empty()) signal.name = path_of(path).filename().string();
  added_.signals.push_back(std::move(signal));
  changed_ = true;
  return static_cast<std::uint32_t>(added_.signals.size() - 1);
}

Result<std::uint32_t> ApplicationLevel::add_samples(std::span<const float> samples, int rate_hz,
                                                    std::string name, bool loop) {
  if (samples.size() / static_cast<std::uint64_t>(rate_hz) > kMaxSound_s)
    return Error(in_quotes(name) + " is longer than 30 minutes, the most that is stored; cut it");
  // A sound file in memory, so that it is checked and resampled like one on disk.
  std::vector<std::byte> file =
      wav_header({.channels = 1, .rate_hz = rate_hz}, samples.size_bytes());
  const auto bytes = std::as_bytes(samples);
  file.insert(file.end(), bytes.begin(), bytes.end());
  auto decoded = decode_audio(file, in_quotes(name));
  if (!decoded.ok()) return decoded.error();
  added_.signals.push_back({std::move(name), std::move(*decoded), loop});
  changed_ = true;
  return static_cast<std::uint32_t>(added_.signals.size() - 1);
}

Result<void> ApplicationLevel::add_emitter(Emitter emitter) {
  if (emitter.signal >= added_.signals.size())
    return Error(fmt::format("there is no sound {}; add it first", emitter.signal));
  if (emitter.name.empty())
    emitter.name = path_of(added_.signals[emitter.signal].name).stem().string();
  for (const auto* emitters : {&file_.level.emitters, &added_.emitters})
    for (const Emitter& known : *emitters)
      if (known.name == emitter.name)
        return Error("another emitter is named " + in_quotes(emitter.name) +
                     "; give each its own name");
  const auto refused = [&](const std::string& why) {
    return Error(why).in(in_quotes(emitter.name));
  };
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(emitter.position_m[i]) <= kMaxWorldCoordinate_m) ||
        !(std::abs(emitter.axis[i]) <= kMaxWorldCoordinate_m))
      return refused("its position or direction is not finite, or beyond 100 000 km");
  if (!(length(emitter.axis) > 0)) return refused("its direction has no length");
  emitter.axis = normalize(emitter.axis);
  if (!(emitter.gain >= 0 && emitter.gain <= kMaxGain))
    return refused(fmt::format("its gain must be from 0 to {:g}", kMaxGain));
  if (const auto ok = check_bands(emitter.directivity, "its directivity", kMaxDirectivity);
      !ok.ok())
    return refused(ok.error().message);
  if (!(emitter.delay_s >= 0 && emitter.delay_s <= kMaxDelay_s))
    return refused(fmt::format("its delay must be from 0 to {:g} s", kMaxDelay_s));
  added_.emitters.push_back(std::move(emitter));
  changed_ = true;
  return {};
}

// The limits of a sidecar.
Result<void> ApplicationLevel::set_air(const Air& air) {
  if (!(air.temperature_c >= -60 && air.temperature_c <= 80) ||
      !(air.humidity_percent >= 0 && air.humidity_percent <= 100) ||
      !(air.pressure_kpa >= 10 && air.pressure_kpa <= 200))
    return Error("the air must have -60 to 80 C, 0 to 100 % humidity and 10 to 200 kPa");
  added_.air = air;
  changed_ = true;
  return {};
}

Boundsf ApplicationLevel::bounds() const {
  Boundsf all;
  Boundsf of_file = bounds_of(file_.level.mesh);
  if (!of_file.is_empty()) {
    of_file.low_m = Vec3f(Vec3(of_file.low_m) + file_.level.origin_m);
    of_file.high_m = Vec3f(Vec3(of_file.high_m) + file_.level.origin_m);
  }
  all.add(of_file);
  all.add(bounds_of(added_.mesh));
  return all.is_empty() ? Boundsf{Vec3f(0), Vec3f(0)} : all;
}

void ApplicationLevel::append_mesh(ImportedLevel& whole) const {
  Level& level = whole.level;
  std::vector<MaterialAssignment> used(added_.materials.size());
  for (std::size_t t = 0; t < added_.mesh.triangles.size(); ++t) {
    MaterialAssignment& measured = used[added_.mesh.materials[t]];
    ++measured.triangles;
    measured.area_m2 += area_m2(added_.mesh, added_.mesh.triangles[t]);
  }
  std::vector<std::uint16_t> numbers(used.size());
  for (std::size_t m = 0; m < used.size(); ++m) {
    if (used[m].triangles == 0) continue;
    numbers[m] = static_cast<std::uint16_t>(level.materials.size());
    level.materials.push_back(added_.materials[m]);
    used[m].material = added_.materials[m].name;
    used[m].how = "application";
    whole.report.materials.push_back(used[m]);
  }
  Mesh& mesh = level.mesh;
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  for (const Vec3f& vertex_m : added_.mesh.vertices_m)
    mesh.vertices_m.emplace_back(Vec3(vertex_m) - level.origin_m);
  for (std::array<std::uint32_t, 3> triangle : added_.mesh.triangles) {
    for (std::uint32_t& corner : triangle) corner += first;
    mesh.triangles.push_back(triangle);
  }
  for (const std::uint16_t material : added_.mesh.materials)
    mesh.materials.push_back(numbers[material]);
}

// Sounds are in the order of the first emitters that play them, as in an imported level.
void ApplicationLevel::append_emitters(Level& level) const {
  std::vector<std::optional<std::uint32_t>> numbers(added_.signals.size());
  for (Emitter emitter : added_.emitters) {
    std::optional<std::uint32_t>& number = numbers[emitter.signal];
    if (!number) {
      number = static_cast<std::uint32_t>(level.signals.size());
      level.signals.push_back(added_.signals[emitter.signal]);
    }
    emitter.signal = *number;
    emitter.position_m -= level.origin_m;
    level.emitters.push_back(std::move(emitter));
  }
}

Result<ImportedLevel> ApplicationLevel::whole(std::optional<std::uint64_t> seed,
                                              std::optional<std::uint64_t>& file_hash) const {
  file_hash = std::nullopt;
  ImportedLevel whole;
  if (!path_.empty() && seed && *seed != file_.settings.seed.value_or(1)) {
    ImportOptions options = options_;
    options.seed = seed;
    auto again = import_level(path_, options);
    if (!again.ok()) return again.error();
    whole = std::move(*again);
  } else {
    whole = file_;
  }
  if (!path_.empty()) file_hash = whole.input_hash;
  if (is_file_alone()) return whole;

  if (path_.empty() && !added_.mesh.vertices_m.empty()) {
    const Boundsf bounds = bounds_of(added_.mesh.vertices_m);
    whole.level.origin_m = level_origin_m((Vec3(bounds.low_m) + Vec3(bounds.high_m)) / 2.0);
  }
  append_mesh(whole);
  append_emitters(whole.level);
  if (const auto ok = check_places(whole.level); !ok.ok()) return ok.error();
  if (const auto ok = check_surfaces(whole.level); !ok.ok()) return ok.error();
  whole.level.air = added_.air;
  const auto& inputs = folder_.inputs();
  whole.inputs.insert(whole.inputs.end(), inputs.begin(), inputs.end());
  whole.files.add(folder_.files());
  whole.report.found.push_back(
      fmt::format("{} triangles, {} materials, {} sounds and {} emitters "
                  "of the application",
                  added_.mesh.triangles.size(), added_.materials.size(), added_.signals.size(),
                  added_.emitters.size()));
  if (without_area_ > 0)
    whole.report.ignored.push_back(fmt::format("{} triangles without area", without_area_));
  InputHash hash;
  hash.add(std::as_bytes(std::span(&whole.input_hash, 1)));
  hash_list(hash, whole.level.mesh.vertices_m);
  hash_list(hash, whole.level.mesh.triangles);
  hash_list(hash, whole.level.mesh.materials);
  for (const Signal& signal : whole.level.signals) hash_list(hash, signal.samples);
  whole.input_hash = finish_hash(hash, whole.level);
  return whole;
}

}  // namespace clamor
