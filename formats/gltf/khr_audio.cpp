#include "formats/gltf/khr_audio.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "common/maths.h"
#include "formats/level/emitter_spec.h"

namespace clamor {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kMaxEntries = 1e6;
constexpr const char* kExtension = "KHR_audio_emitter";

std::optional<std::size_t> entry(JsonFields& fields, std::string_view key) {
  const auto value = fields.number(key, 0, kMaxEntries);
  if (!value) return std::nullopt;
  if (std::floor(*value) != *value) fields.fail(in_quotes(key) + " must be a whole number");
  return static_cast<std::size_t>(*value);
}

std::vector<std::size_t> entries(JsonFields& fields, std::string_view key, std::size_t count) {
  std::vector<std::size_t> result;
  const Json* list = fields.any(key);
  if (list == nullptr) return result;
  if (list->array() == nullptr) {
    fields.fail(in_quotes(key) + " must be a list");
    return result;
  }
  for (const Json& item : *list->array()) {
    const double* index = item.number();
    if (index == nullptr || std::floor(*index) != *index || *index < 0 ||
        *index >= static_cast<double>(count)) {
      fields.fail(fmt::format("'{}' points to none of the {} there are", key, count));
      return result;
    }
    result.push_back(static_cast<std::size_t>(*index));
  }
  return result;
}

void read_positional(const Json& json, const std::string& where, KhrEmitter& emitter,
                     JsonFields& outer) {
  JsonFields fields(json, where + ": positional");
  const std::string shape = fields.string("shapeType").value_or("");
  const double inner = fields.number("coneInnerAngle", 0, 6.2832).value_or(2 * kPi);
  const double outer_angle = fields.number("coneOuterAngle", 0, 6.2832).value_or(2 * kPi);
  const double outer_gain = fields.number("coneOuterGain", 0, 1).value_or(0);
  if (shape != "omnidirectional" && inner < 2 * kPi - 1e-4) {
    emitter.directivity = exponent_of_cone(inner, outer_angle, outer_gain);
    emitter.notes.push_back(fmt::format(
        "{}: a cone of {:.0f} to {:.0f} degrees, gain {:g} outside, became directivity {:.3g}, "
        "which radiates the same power",
        where, inner * 180 / kPi, outer_angle * 180 / kPi, outer_gain, emitter.directivity));
  }

  emitter.faces_plus_z = fields.boolean("facesPlusZ").value_or(false);
  const double reference_m = fields.number("refDistance", 0, 1e6).value_or(1);
  emitter.gain *= reference_m > 0 ? reference_m : 1;
  const std::string model = fields.string("distanceModel").value_or("inverse");
  const double rolloff = fields.number("rolloffFactor", 0, 1e6).value_or(1);
  if (model != "inverse" || rolloff != 1)
    emitter.notes.push_back(
        fmt::format("{}: distance model '{}' with rolloff {:g} is a designer's curve; sound falls "
                    "as 1 / r here",
                    where, model, rolloff));
  if (fields.number("maxDistance", 0, 1e9).value_or(0) > 0)
    emitter.notes.push_back(where + ": maxDistance ignored; sound has no end");
  if (const auto ok = fields.result(); !ok.ok()) outer.fail(ok.error().message);
}

Result<KhrEmitter> read_emitter(const Json& json, std::size_t index, std::size_t source_count) {
  KhrEmitter emitter;
  JsonFields fields(json, fmt::format("{} emitter {}", kExtension, index));
  emitter.name = fields.string("name").value_or("");
  const std::string where =
      "emitter " + (emitter.name.empty() ? std::to_string(index) : in_quotes(emitter.name));
  emitter.gain = fields.number("gain", 0, kMaxGain).value_or(1);
  emitter.sources = entries(fields, "sources", source_count);
  emitter.global = fields.string("type").value_or("positional") == "global";
  if (const Json* positional = fields.any("positional"); positional != nullptr && !emitter.global)
    read_positional(*positional, where, emitter, fields);
  if (const auto ok = fields.result(); !ok.ok()) return ok.error();
  return emitter;
}

Result<KhrSource> read_source(const Json& json, std::size_t index, std::size_t audio_count) {
  KhrSource source;
  JsonFields fields(json, fmt::format("{} source {}", kExtension, index));
  source.name = fields.string("name").value_or("");
  source.gain = fields.number("gain", 0, kMaxGain).value_or(1);
  source.loop = fields.boolean("loop").value_or(false);
  source.playback_rate = fields.number("playbackRate", -1000, 1000).value_or(1);
  source.audio = entry(fields, "audio");
  if (source.audio && *source.audio >= audio_count)
    fields.fail(fmt::format("'audio' points to none of the {} there are", audio_count));
  if (const auto ok = fields.result(); !ok.ok()) return ok.error();
  return source;
}

Result<KhrAudio> read_audio_entry(const Json& json, std::size_t index, std::size_t view_count) {
  KhrAudio audio;
  JsonFields fields(json, fmt::format("{} audio {}", kExtension, index));
  audio.name = fields.string("name").value_or("");
  audio.uri = fields.string("uri").value_or("");
  audio.view = entry(fields, "bufferView");
  if (audio.view && *audio.view >= view_count)
    fields.fail(fmt::format("'bufferView' points to none of the {} there are", view_count));
  if (audio.uri.empty() && !audio.view) fields.fail("has neither 'uri' nor 'bufferView'");
  if (const auto ok = fields.result(); !ok.ok()) return ok.error();
  return audio;
}

// Reads all elements of the list `key` of the extension.
template <class T, class Read>
Result<std::vector<T>> read_list(const Json& extension, const char* key, Read read) {
  std::vector<T> result;
  const Json* list = extension.find(key);
  if (list == nullptr) return result;
  if (list->array() == nullptr)
    return Error(fmt::format("{}: '{}' must be a list; export the level again.", kExtension, key));
  for (const Json& item : *list->array()) {
    auto value = read(item, result.size());
    if (!value.ok()) return value.error();
    result.push_back(std::move(*value));
  }
  return result;
}

std::size_t list_size(const Json& object, const char* key) {
  const Json* list = object.find(key);
  return list == nullptr || list->array() == nullptr ? 0 : list->array()->size();
}

}  // namespace

Result<KhrAudioScene> read_khr_audio(const Json& document) {
  KhrAudioScene scene;
  const Json* extension = document.find({"extensions", kExtension});
  if (extension == nullptr) return scene;

  const std::size_t views = list_size(document, "bufferViews");
  auto audio = read_list<KhrAudio>(*extension, "audio", [&](const Json& json, std::size_t i) {
    return read_audio_entry(json, i, views);
  });
  if (!audio.ok()) return audio.error();
  auto sources = read_list<KhrSource>(*extension, "sources", [&](const Json& json, std::size_t i) {
    return read_source(json, i, audio->size());
  });
  if (!sources.ok()) return sources.error();
  auto emitters = read_list<KhrEmitter>(
      *extension, "emitters",
      [&](const Json& json, std::size_t i) { return read_emitter(json, i, sources->size()); });
  if (!emitters.ok()) return emitters.error();
  scene.audio = std::move(*audio);
  scene.sources = std::move(*sources);
  scene.emitters = std::move(*emitters);
  return scene;
}

Result<std::vector<std::size_t>> khr_emitters_of(const Json& node, const KhrAudioScene& audio) {
  const Json* extension = node.find({"extensions", kExtension});
  if (extension == nullptr) return std::vector<std::size_t>{};
  JsonFields fields(*extension, kExtension);
  auto result = entries(fields, "emitters", audio.emitters.size());
  if (const auto old = entry(fields, "emitter")) {
    if (*old >= audio.emitters.size())
      fields.fail(
          fmt::format("'emitter' points to none of the {} there are", audio.emitters.size()));
    result.push_back(*old);
  }
  if (const auto ok = fields.result(); !ok.ok()) return ok.error();
  return result;
}

double exponent_of_cone(double inner_rad, double outer_rad, double outer_gain) {
  const double inner = inner_rad / 2, outer = std::max(outer_rad, inner_rad) / 2;
  // Squared gain averaged over the sphere: closed forms inside and outside, Simpson's rule between.
  double mean_square = (1 - cos_of(inner)) / 2 + outer_gain * outer_gain * (1 + cos_of(outer)) / 2;
  constexpr int kSteps = 256;
  const double step = (outer - inner) / kSteps;
  for (int i = 0; i <= kSteps; ++i) {
    const double gain = 1 + (outer_gain - 1) * i / kSteps;
    const double weight = i == 0 || i == kSteps ? 1 : i % 2 == 1 ? 4 : 2;
    mean_square += weight * step / 3 * gain * gain * sin_of(inner + i * step) / 2;
  }
  // The directivity law averages to 1 / (p + 1).
  return std::clamp(1 / std::max(mean_square, 1e-9) - 1, 0.0, kMaxDirectivity);
}

}  // namespace clamor
