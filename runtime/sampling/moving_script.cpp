#include "runtime/sampling/moving_script.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/utf8_path.h"
#include "formats/audio/audio_file.h"
#include "formats/files/json.h"
#include "formats/files/level_folder.h"
#include "formats/level/signal_table.h"

namespace clamor {

namespace {

constexpr double kMaxTime_s = 1e7;
constexpr double kVelocityStep_s = 0.02;
constexpr double kJump_mps = 150;  // a path that is faster jumps

std::string folder_of(const std::string& path) {
  const std::string folder = path_of(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

}  // namespace

Result<MovingScript> MovingScript::read(const std::string& path) {
  auto json = read_json(path);
  if (!json.ok()) return json.error();
  shorten_names(*json);
  JsonFields fields(*json, path);
  fields.any("comment");
  const Json* const portals = fields.any("portals");
  const Json* const sources = fields.any("sources");
  const Json* const parts = fields.any("parts");
  if (sources == nullptr ? parts == nullptr && portals == nullptr
                         : sources->array() == nullptr || sources->array()->empty())
    fields.fail(
        "needs 'sources', a list of at least one { \"signal\": \"noise\", \"path\": ... }, "
        "'parts' or 'portals'");
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();

  MovingScript script;
  script.files_.add(path);
  if (portals != nullptr) {
    auto parsed = PortalScript::parse(*portals, path);
    if (!parsed.ok()) return parsed.error();
    script.portals_ = std::move(*parsed);
  }
  SignalTable signals;
  if (sources != nullptr)
    for (const Json& item : *sources->array()) {
      const std::string where = path + ": source " + std::to_string(script.sources_.size() + 1);
      if (const auto ok = script.read_source(item, where, path, signals); !ok.ok())
        return ok.error();
    }
  if (parts != nullptr) {
    auto parsed = PartScript::parse(*parts, path);
    if (!parsed.ok()) return parsed.error();
    script.parts_ = std::move(*parsed);
  }
  script.signals_ = signals.take();
  return script;
}

Result<void> MovingScript::read_source(const Json& json, const std::string& where,
                                       const std::string& path, SignalTable& signals) {
  JsonFields values(json, where);
  ScriptedSource scripted;
  scripted.name = values.string("name").value_or("");
  const std::string signal = values.string("signal").value_or("noise");
  const bool loop = values.boolean("loop").value_or(signal != "impulse");
  scripted.gain = std::pow(10, values.number("gain_db", -200, 120).value_or(0) / 20);
  const double reverberation_db = values.number("reverberation_db", -200, 40).value_or(0);
  scripted.reverberation = reverberation_db > -200 ? std::pow(10, reverberation_db / 20) : 0;
  scripted.directivity = values.number("directivity", 0, 1e4).value_or(0);
  scripted.from_s = values.number("from_s", 0, kMaxTime_s).value_or(0);
  scripted.until_s = values.number("until_s", scripted.from_s, kMaxTime_s).value_or(kMaxTime_s);
  const Json* const walk = values.any("path");
  if (walk == nullptr) values.fail("'path' is missing");
  if (const auto ok = values.result_without_unknown(); !ok.ok()) return ok.error();
  auto parsed = Walk::parse(*walk, where + ", 'path'");
  if (!parsed.ok()) return parsed.error();
  scripted.path = std::move(*parsed);

  if (is_built_in_signal(signal)) {
    scripted.signal = signals.built_in(signal, loop);
  } else if (const auto known = signals.find(signal, loop)) {
    scripted.signal = *known;
  } else {
    const auto file = confined_path(folder_of(path), signal);
    if (!file.ok()) return file.error().in(where + ", 'signal'");
    auto samples = read_audio(*file);
    if (!samples.ok()) return samples.error().in(where);
    files_.add(*file);
    scripted.signal = signals.add(signal, signal, std::move(*samples), loop);
  }
  sources_.push_back(std::move(scripted));
  return {};
}

MovingOptions MovingScript::options(std::size_t signals_of_bake) const {
  MovingOptions options;
  options.max_sources = sources_.size();
  options.signals = signals_;
  options.reverberates = std::any_of(sources_.begin(), sources_.end(), [](const auto& scripted) {
    return scripted.reverberation > 0;
  });
  for (const ScriptedSource& scripted : sources_)
    options.kinds.push_back({scripted.name,
                             static_cast<std::uint32_t>(signals_of_bake + scripted.signal),
                             same_in_all_bands(static_cast<float>(scripted.directivity))});
  return options;
}

Result<void> MovingScript::apply(MovingSources* moving, const PartScript::Stage& stage,
                                 double time_s) {
  if (const auto ok = parts_.apply(stage, time_s); !ok.ok()) return ok;
  return moving == nullptr ? Result<void>() : apply(*moving, time_s);
}

Result<void> MovingScript::apply(MovingSources& moving, double time_s) {
  for (std::uint32_t kind = 0; kind < sources_.size(); ++kind) {
    ScriptedSource& scripted = sources_[kind];
    const bool is_present = time_s >= scripted.from_s && time_s < scripted.until_s;
    if (!is_present && scripted.is_present)
      if (const auto ok = moving.remove(scripted.handle); !ok.ok()) return ok;
    if (is_present) {
      const Listener on_path = scripted.path.at(time_s);
      MovingSource source;
      source.kind = kind;
      source.position_m = on_path.position_m;
      const Vec3 velocity_mps =
          (on_path.position_m - scripted.path.at(time_s - kVelocityStep_s).position_m) /
          kVelocityStep_s;
      if (length(velocity_mps) <= kJump_mps) source.velocity_mps = velocity_mps;
      source.axis = on_path.forward();
      source.gain = same_in_all_bands(static_cast<float>(scripted.gain));
      source.reverberation = static_cast<float>(scripted.reverberation);
      source.start_s = scripted.from_s;
      if (!scripted.is_present) {
        const auto added = moving.add(source);
        if (!added.ok()) return added.error();
        scripted.handle = *added;
      } else if (const auto ok = moving.change(scripted.handle, source); !ok.ok()) {
        return ok;
      }
    }
    scripted.is_present = is_present;
  }
  moving.commit(time_s);
  return {};
}

}  // namespace clamor
