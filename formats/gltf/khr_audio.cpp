#include "formats/gltf/khr_audio.h"

#include <algorithm>
#include <numbers>

#include <fmt/format.h>

#include "common/maths.h"
#include "formats/level/emitter_spec.h"

namespace clamor {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kMaxEntries = 1'000'001;
constexpr double kDecibelsPerDoubling = 20 * std::numbers::ln2 / std::numbers::ln10;
constexpr const char* kExtension = "KHR_audio_emitter";

std::optional<std::size_t> entry(JsonFields& fields, std::string_view key) {
  const Json* value = fields.any(key);
  if (value == nullptr) return std::nullopt;
  const auto index = index_below(value, kMaxEntries);
  if (!index) fields.fail(in_quotes(key) + " must be a whole number from 0 on");
  return index;
}

std::vector<std::size_t> entries(JsonFields& fields, std::string_view key) {
  std::vector<std::size_t> result;
  const Json* list = fields.any(key);
  if (list == nullptr) return result;
  if (list->array() == nullptr) {
    fields.fail(in_quotes(key) + " must be a list");
    return result;
  }
  for (const Json& entry : *list->array()) {
    const auto index = index_below(&entry, kMaxEntries);
    if (!index) fields.fail(in_quotes(key) + " must be a list of whole numbers from 0 on");
    result.push_back(index.value_or(0));
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
  if (reference_m > 0 && reference_m != 1) {
    emitter.gain *= reference_m;
    emitter.notes.push_back(
        fmt::format("{}: refDistance {:g} m: {:+.1f} dB at 1 m, so that the level at {:g} m is the "
                    "game's; nearer "
                    "than that it is louder here, where the game keeps it constant",
                    where, reference_m, kDecibelsPerDoubling * log2_of(reference_m), reference_m));
  }
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

Result<KhrEmitter> read_emitter(const Json& json, std::size_t index) {
  KhrEmitter emitter;
  JsonFields fields(json, fmt::format("{} emitter {}", kExtension, index));
  emitter.name = fields.string("name").value_or("");
  const std::string where =
      "emitter " + (emitter.name.empty() ? std::to_string(index) : in_quotes(emitter.name));
  emitter.gain = fields.number("gain", 0, kMaxGain).value_or(1);
  emitter.sources = entries(fields, "sources");
  emitter.global = fields.string("type").value_or("positional") == "global";
  if (const Json* positional = fields.any("positional"); positional != nullptr && !emitter.global)
    read_positional(*positional, where, emitter, fields);
  if (const auto ok = fields.result(); !ok.ok()) return ok.error();
  return emitter;
}

Result<KhrSource> read_source(const Json& json, std::size_t index) {
  KhrSource source;
  JsonFields fields(json, fmt::format("{} source {}", kExtension, index));
  source.name = fields.string("name").value_or("");
  source.gain = fields.number("gain", 0, kMaxGain).value_or(1);
  source.loop = fields.boolean("loop").value_or(false);
  for (const char* key : {"autoplay", "autoPlay"})
    source.autoplay = fields.boolean(key).value_or(source.autoplay);
  for (const char* key : {"playbackRate", "pitchSpeed"})
    source.playback_rate = fields.number(key, -1000, 1000).value_or(source.playback_rate);
  // OMI_audio_ogg_vorbis and OMI_audio_opus name a better encoding than the source's own.
  if (const Json* extensions = fields.any("extensions"); extensions && extensions->object())
    for (const auto& [name, extension] : *extensions->object())
      if (extension.find("audio") != nullptr) {
        JsonFields codec(extension, fields.where() + ": " + name);
        if (const auto audio = entry(codec, "audio")) source.audio.push_back(*audio);
        if (const auto ok = codec.result(); !ok.ok()) fields.fail(ok.error().message);
      }
  if (const auto audio = entry(fields, "audio")) source.audio.push_back(*audio);
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

// Reads all elements of the list `key` of the extension; none if it is missing or no list.
template <class T, class Read>
std::vector<Result<T>> read_list(const Json& extension, const char* key, Read read) {
  std::vector<Result<T>> result;
  for (const Json& item : extension.list(key)) result.push_back(read(item, result.size()));
  return result;
}

}  // namespace

KhrAudioScene read_khr_audio(const Json& document) {
  KhrAudioScene scene;
  const Json* extension = document.find({"extensions", kExtension});
  if (extension == nullptr) return scene;
  const std::size_t views = document.list("bufferViews").size();
  scene.audio = read_list<KhrAudio>(*extension, "audio", [&](const Json& json, std::size_t i) {
    return read_audio_entry(json, i, views);
  });
  scene.sources = read_list<KhrSource>(*extension, "sources", read_source);
  scene.emitters = read_list<KhrEmitter>(*extension, "emitters", read_emitter);
  return scene;
}

Result<std::vector<std::size_t>> khr_emitters_of(const Json& user) {
  const Json* extension = user.find({"extensions", kExtension});
  if (extension == nullptr) return std::vector<std::size_t>{};
  JsonFields fields(*extension, kExtension);
  auto result = entries(fields, "emitters");
  const auto old = entry(fields, "emitter");
  if (old && std::ranges::find(result, *old) == result.end()) result.push_back(*old);
  if (const auto ok = fields.result(); !ok.ok()) return ok.error();
  return result;
}

Error missing_khr_entry(std::string_view key, std::size_t index, std::size_t count) {
  return Error(fmt::format("'{}' points to entry {} of {}", key, index, count));
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
