#include "runtime/sampling/moving_script.h"

#include <cmath>
#include <filesystem>

#include "formats/audio/audio_file.h"
#include "formats/files/json.h"
#include "formats/level/level_folder.h"
#include "formats/level/signal_table.h"

namespace clamor {

namespace {

constexpr double kLongest_s = 1e7;
constexpr double kStep_s = 0.02;  // that velocities are told from

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

}  // namespace

Result<MovingScript> MovingScript::read(const std::string& path) {
  const auto json = read_json(path);
  if (!json.ok()) return json.error();
  JsonFields fields(*json, path);
  fields.any("comment");
  const Json* sources = fields.any("sources");
  if (sources == nullptr || sources->array() == nullptr || sources->array()->empty())
    fields.fail("needs 'sources', a list of at least one { \"signal\": \"noise\", \"path\": ... }");
  if (const auto ok = fields.result_without_unknown(); !ok.ok()) return ok.error();

  MovingScript script;
  script.files_.add(path);
  SignalTable signals;
  for (const Json& item : *sources->array()) {
    const std::string where = path + ": source " + std::to_string(script.actors_.size() + 1);
    JsonFields values(item, where);
    Actor actor;
    actor.name = values.string("name").value_or("");
    const std::string signal = values.string("signal").value_or("noise");
    const bool loop = values.boolean("loop").value_or(signal != "impulse");
    actor.gain = std::pow(10, values.number("gain_db", -200, 120).value_or(0) / 20);
    actor.directivity = values.number("directivity", 0, 1e4).value_or(0);
    actor.from_s = values.number("from_s", 0, kLongest_s).value_or(0);
    actor.until_s = values.number("until_s", 0, kLongest_s).value_or(kLongest_s);
    const Json* const walk = values.any("path");
    if (walk == nullptr) values.fail("'path' is missing");
    if (const auto ok = values.result_without_unknown(); !ok.ok()) return ok.error();
    auto parsed = Walk::parse(*walk, where + ", 'path'");
    if (!parsed.ok()) return parsed.error();
    actor.path = std::move(*parsed);

    if (is_built_in_signal(signal)) {
      actor.signal = signals.built_in(signal, loop);
    } else if (const auto known = signals.find(signal, loop)) {
      actor.signal = *known;
    } else {
      const auto file = confined_path(folder_of(path), signal);
      if (!file.ok()) return file.error().in(where + ", 'signal'");
      auto samples = read_audio(*file);
      if (!samples.ok()) return samples.error().in(where);
      script.files_.add(*file);
      actor.signal = signals.add(signal, signal, std::move(*samples), loop);
    }
    script.actors_.push_back(std::move(actor));
  }
  script.signals_ = signals.take();
  return script;
}

MovingOptions MovingScript::options(std::size_t signals_of_bake) const {
  MovingOptions options;
  options.most = actors_.size();
  options.signals = signals_;
  for (const Actor& actor : actors_)
    options.kinds.push_back({actor.name, static_cast<std::uint32_t>(signals_of_bake + actor.signal),
                             same_in_all_bands(static_cast<float>(actor.directivity))});
  return options;
}

Result<void> MovingScript::apply(MovingSources& moving, double time_s) {
  for (std::uint32_t kind = 0; kind < actors_.size(); ++kind) {
    Actor& actor = actors_[kind];
    const bool on_stage = time_s >= actor.from_s && time_s < actor.until_s;
    if (!on_stage && actor.on_stage)
      if (const auto ok = moving.remove(actor.handle); !ok.ok()) return ok;
    if (on_stage) {
      const Listener pose = actor.path.at(time_s);
      MovingSource source;
      source.kind = kind;
      source.position_m = pose.position_m;
      source.velocity_mps =
          (pose.position_m - actor.path.at(time_s - kStep_s).position_m) / kStep_s;
      source.axis = pose.forward();
      source.gain = same_in_all_bands(static_cast<float>(actor.gain));
      source.start_s = actor.from_s;
      if (!actor.on_stage) {
        const auto added = moving.add(source);
        if (!added.ok()) return added.error();
        actor.handle = *added;
      } else if (const auto ok = moving.retune(actor.handle, source); !ok.ok()) {
        return ok;
      }
    }
    actor.on_stage = on_stage;
  }
  moving.commit(time_s);
  return {};
}

}  // namespace clamor
