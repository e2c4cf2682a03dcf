#include "formats/gltf/gltf_sounds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "common/maths.h"
#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/gltf/gltf_marks.h"
#include "formats/gltf/khr_audio.h"
#include "formats/gltf/report_words.h"
#include "formats/level/acoustic_values.h"
#include "formats/level/emitter_spec.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxEmitters = 10'000'000;

// Members of CLAMOR_emitter, if present.
struct Extra {
  std::optional<Bands> directivity;
  std::optional<double> gain_db, delay_s, random_delay_s;
};

Result<void> read_extra(const Json* json, const std::string& where, Extra& extra) {
  if (json == nullptr) return {};
  JsonFields fields(*json, where + ": CLAMOR_emitter");
  if (const auto bands = bands_member(fields, "directivity", 0, kMaxDirectivity))
    extra.directivity = bands;
  if (const auto gain_db = fields.number("gain_db", -200, 80)) extra.gain_db = gain_db;
  if (const auto delay_s = fields.number("delay_s", 0, kMaxDelay_s)) extra.delay_s = delay_s;
  if (const auto max_s = fields.number("random_delay_s", 0, kMaxDelay_s))
    extra.random_delay_s = max_s;
  for (const char* note : {"name", "comment", "extras", "extensions"}) fields.any(note);
  return fields.result_without_unknown();
}

// Reads the extras and then the extension of a node or KHR emitter; later values override.
Result<void> read_extras(const Json& object, const std::string& where, Extra& extra) {
  if (const auto ok = read_extra(object.find({"extras", "clamor_emitter"}), where, extra); !ok.ok())
    return ok;
  return read_extra(object.find({"extensions", "CLAMOR_emitter"}), where, extra);
}

class SoundReader {
 public:
  SoundReader(const GltfScene& scene, LevelFolder& folder, SignalTable& signals, std::uint64_t seed,
              ImportReport& report)
      : scene_(scene), folder_(folder), signals_(signals), seed_(seed), report_(report) {}

  Result<SceneSounds> read(const std::vector<PlacedNode>& placements) {
    audio_ = read_khr_audio(scene_.json);
    used_.assign(audio_.emitters.size(), false);
    for (std::size_t p = 0; p < placements.size();) {
      // All instances of a node are adjacent and share what is read from it.
      std::size_t end = p + 1;
      while (end < placements.size() && placements[end].node == placements[p].node) ++end;
      if (const auto ok = read_node(std::span(placements).subspan(p, end - p)); !ok.ok())
        return ok.error();
      p = end;
    }
    report_rest();
    return std::move(out_);
  }

 private:
  // What is wrong with the sounds of a node costs its emitters and not the level.
  Result<void> read_node(std::span<const PlacedNode> places) {
    const auto n = static_cast<std::size_t>(places[0].node);
    const Json& node = scene_.json.list("nodes")[n];
    const GltfNode& plain = scene_.nodes[n];
    const std::string where = node_in_words(scene_, n);
    const auto emitters = khr_emitters_of(node);
    if (!emitters.ok()) {
      leave_out(where, places[0], emitters.error().message);
      return {};
    }
    if (emitters->empty()) {
      if (node.find({"extensions", "CLAMOR_emitter"}) != nullptr)
        report_.warnings.push_back(where +
                                   " has CLAMOR_emitter but no KHR_audio_emitter, so nothing "
                                   "says what it plays; ignored");
      return {};
    }
    for (const std::size_t index : *emitters) {
      const auto entry = khr_entry(audio_.emitters, "emitters", index);
      if (!entry.ok()) {
        leave_out(where, places[0],
                  entry.error().message +
                      (index < audio_.emitters.size()
                           ? ""
                           : " (tools that do not know the extension drop its lists)"));
        if (index < used_.size()) used_[index] = true;
        continue;
      }
      const KhrEmitter& emitter = **entry;
      if (emitter.global) {
        warn_global(index, emitter);
        continue;
      }
      if (!used_[index])
        report_.ignored.insert(report_.ignored.end(), emitter.notes.begin(), emitter.notes.end());
      used_[index] = true;
      Extra extra;
      const Json* json = scene_.json.find({"extensions", "KHR_audio_emitter"});
      if (const auto ok = read_extras(json->list("emitters")[index], where, extra); !ok.ok())
        return ok;
      if (const auto ok = read_extras(node, where, extra); !ok.ok()) return ok;
      std::string name = !plain.name.empty()     ? plain.name
                         : !emitter.name.empty() ? emitter.name
                                                 : fmt::format("emitter {}", index);
      if (emitters->size() > 1)
        name += "/" + (emitter.name.empty() ? std::to_string(index) : emitter.name);
      if (const auto ok = add(places, emitter, extra, name); !ok.ok()) return ok.error().in(where);
    }
    return {};
  }

  Result<void> add(std::span<const PlacedNode> places, const KhrEmitter& emitter,
                   const Extra& extra, const std::string& name) {
    if (emitter.sources.empty()) leave_out(in_quotes(name), places[0], "it has no source");
    for (const std::size_t index : emitter.sources) {
      const auto entry = khr_entry(audio_.sources, "sources", index);
      const auto signal = entry.ok() ? load(**entry, index) : entry.error();
      if (!signal.ok()) {
        leave_out(in_quotes(name), places[0], signal.error().message);
        continue;
      }
      const KhrSource& source = **entry;
      if (!source.autoplay) waiting_.insert(index);
      if (out_.emitters.size() + places.size() > kMaxEmitters)
        return Error(
            fmt::format("the level has more than {} emitters, the most that are read; thin "
                        "them out.",
                        kMaxEmitters));
      const std::string source_name =
          emitter.sources.size() == 1
              ? name
              : name + "/" + (source.name.empty() ? std::to_string(index) : source.name);
      for (const PlacedNode& place : places) {
        auto made = make(place, emitter, extra);
        if (!made.ok()) return made.error();
        made->name =
            place.instanced ? fmt::format("{} #{}", source_name, place.instance) : source_name;
        made->gain *= source.gain;
        made->signal = *signal;
        made->delay_s += place.delay_s;
        out_.emitters.push_back(std::move(*made));
        out_.nodes.push_back(place.node);
      }
    }
    return {};
  }

  Result<Emitter> make(const PlacedNode& place, const KhrEmitter& emitter,
                       const Extra& extra) const {
    Emitter made;
    made.position_m = Vec3(place.world[3]);
    const Vec3 ahead(place.world * glm::dvec4(0, 0, emitter.faces_plus_z ? 1 : -1, 0));
    const double stretch = length(ahead);
    if (!is_finite(made.position_m) || length(made.position_m) > kMaxEmitterCoordinate_m ||
        !std::isfinite(stretch))
      return Error(
          "its emitter is not within 1000 km of the level's middle; repair the transforms.");
    if (stretch > 0) made.axis = ahead / stretch;
    made.gain = emitter.gain * power(10, extra.gain_db.value_or(0) / 20);
    made.directivity =
        extra.directivity.value_or(same_in_all_bands(static_cast<float>(emitter.directivity)));
    made.delay_s = extra.delay_s.value_or(0) +
                   random_start_s(seed_, out_.emitters.size(), extra.random_delay_s.value_or(0));
    return made;
  }

  // Loads the first encoding of a source that can be read.
  Result<std::uint32_t> load(const KhrSource& source, std::size_t index) {
    Result<std::uint32_t> signal = Error(fmt::format("its source {} has no audio", index));
    for (const std::size_t audio : source.audio) {
      const auto entry = khr_entry(audio_.audio, "audio", audio);
      auto loaded = entry.ok() ? load(**entry, audio, source) : entry.error();
      if (loaded.ok()) return loaded;
      if (!signal.ok()) signal = std::move(loaded);
    }
    return signal;
  }

  Result<std::uint32_t> load(const KhrAudio& audio, std::size_t index, const KhrSource& source) {
    const double rate_hz = kSampleRate_hz * source.playback_rate;
    const bool is_resampled =
        source.playback_rate != 1 && rate_hz >= kMinSoundRate_hz && rate_hz <= kMaxSoundRate_hz;
    std::string key = fmt::format("glTF audio {}", index);
    if (is_resampled) key += fmt::format(" at {:g} times its speed", source.playback_rate);
    if (const auto known = signals_.find(key, source.loop)) return *known;
    if (const auto failed = failed_.find(key); failed != failed_.end()) return failed->second;
    const std::string name = !audio.name.empty()                                   ? audio.name
                             : !source.name.empty()                                ? source.name
                             : audio.uri.starts_with("data:") || audio.uri.empty() ? key
                                                                                   : audio.uri;
    Downmix downmix;
    auto samples = decode(audio, name, downmix);
    if (samples.ok() && is_resampled)
      samples = resampled(*samples, static_cast<int>(std::lround(rate_hz)));
    if (!samples.ok()) {
      failed_.emplace(key, samples.error());
      return samples.error();
    }
    if (source.playback_rate != 1 && !is_resampled)
      report_.ignored.push_back(
          fmt::format("playback rate {:g} of source '{}'", source.playback_rate, source.name));
    report_downmix(downmix, name, report_);
    return signals_.add(key, name, std::move(*samples), source.loop);
  }

  Result<std::vector<float>> decode(const KhrAudio& audio, const std::string& name,
                                    Downmix& downmix) {
    if (!audio.view) {
      const auto bytes = folder_.read(audio.uri);
      if (!bytes.ok()) return bytes.error().in("sound " + in_quotes(name));
      return decode_audio(*bytes, in_quotes(name), &downmix);
    }
    auto samples =
        decode_audio(*scene_.bytes_of(scene_.views[*audio.view]), in_quotes(name), &downmix);
    if (samples.ok()) return samples;
    return Error(
        fmt::format("buffer view {} holds no sound (tools that do not know the extension renumber "
                    "or drop views; "
                    "a sound file beside the level stays what it is): {}",
                    *audio.view, samples.error().message));
  }

  // Notes that an emitter of a node is left out; nodes with the same cause share one warning.
  void leave_out(const std::string& where, const PlacedNode& place, const std::string& cause) {
    const auto [it, is_new] = left_out_.try_emplace(cause, LeftOut{where, Vec3(place.world[3])});
    if (!is_new) ++it->second.others;
  }

  void warn_global(std::size_t index, const KhrEmitter& emitter) {
    if (!used_[index])
      report_.warnings.push_back(
          fmt::format("global emitter {} '{}' has no place in the room; ignored "
                      "(make it positional, or use a sidecar)",
                      index, emitter.name));
    used_[index] = true;
  }

  void report_rest() {
    for (const auto& [why, lost] : left_out_) {
      const std::string_view cause(why.data(), why.size() - (why.ends_with('.') ? 1 : 0));
      report_.warnings.push_back(fmt::format(
          "the emitter of {}{} left out: {}. Repair the level, or add --emitter "
          "\"name=NAME,signal=FILE,at={:g},{:g},{:g}\"",
          lost.first, lost.others == 0 ? " is" : fmt::format(" and {} more are", lost.others),
          cause, lost.at_m.x, lost.at_m.y, lost.at_m.z));
    }
    if (!waiting_.empty()) {
      const std::string& name = (*audio_.sources[*waiting_.begin()]).name;
      report_.ignored.push_back(fmt::format(
          "autoplay false of source {}{}: it plays from the start (mute its emitter until the game "
          "wants it: clamor_change_emitter)",
          name.empty() ? std::to_string(*waiting_.begin()) : in_quotes(name),
          and_more(waiting_.size() - 1)));
    }
    // Emitters that no node references.
    for (std::size_t i = 0; i < audio_.emitters.size(); ++i) {
      if (used_[i]) continue;
      const Result<KhrEmitter>& emitter = audio_.emitters[i];
      if (!emitter.ok())
        report_.ignored.push_back(emitter.error().message);
      else if (emitter->global)
        warn_global(i, *emitter);
      else
        report_.ignored.push_back(
            fmt::format("emitter {} '{}', which stands on no node of the scene", i, emitter->name));
    }
  }

  struct LeftOut {
    std::string first;  // node
    Vec3 at_m{};
    std::size_t others = 0;
  };

  const GltfScene& scene_;
  LevelFolder& folder_;
  SignalTable& signals_;
  std::uint64_t seed_;
  ImportReport& report_;
  KhrAudioScene audio_;
  std::vector<bool> used_;                   // emitters on a node
  std::set<std::size_t> waiting_;            // sources that the game would start
  std::map<std::string, Error> failed_;      // sounds by key
  std::map<std::string, LeftOut> left_out_;  // by cause
  SceneSounds out_;
};

}  // namespace

double random_start_s(std::uint64_t seed, std::size_t index, double max_s) {
  const RandomBits counter = {static_cast<std::uint32_t>(index), 0, 0,
                              static_cast<std::uint32_t>(Use::kPhase)};
  return max_s * unit(philox(seed, counter)[0]);
}

Result<SceneSounds> read_scene_sounds(const GltfScene& scene,
                                      const std::vector<PlacedNode>& placements,
                                      LevelFolder& folder, SignalTable& signals, std::uint64_t seed,
                                      ImportReport& report) {
  return SoundReader(scene, folder, signals, seed, report).read(placements);
}

void report_downmix(const Downmix& downmix, const std::string& name, ImportReport& report) {
  if (auto note = downmix.note(name); !note.empty()) report.ignored.push_back(std::move(note));
  if (auto warning = downmix.warning(name); !warning.empty())
    report.warnings.push_back(std::move(warning));
}

}  // namespace clamor
