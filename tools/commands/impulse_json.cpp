#include "tools/commands/impulse_json.h"

#include <array>
#include <utility>

#include <nlohmann/json.hpp>

#include "common/bands.h"
#include "common/printable.h"
#include "tools/analysis/room_parameters.h"

namespace clamor {

namespace {

nlohmann::ordered_json to_json(const RoomParameters& parameters) {
  nlohmann::ordered_json json;
  for (const ParameterKind& kind : kParameterKinds) {
    auto& values = json[kind.key] = nlohmann::ordered_json::array();
    for (const auto& value : parameters.*kind.value)
      values.push_back(value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr));
  }
  return json;
}

nlohmann::ordered_json to_json(const MeasuredPlace& measured) {
  nlohmann::ordered_json json;
  json["energy"] = to_json(measured.of_energy);
  json["waveform"] = to_json(measured.of_waveform);
  json["warnings"] = nlohmann::ordered_json::array();
  if (measured.warning) json["warnings"].push_back(*measured.warning);
  return json;
}

}  // namespace

std::string impulse_json(std::span<const MeasuredPlace> all) {
  nlohmann::ordered_json json;
  for (const double hz : kBandCentres_hz) json["bands_hz"].push_back(static_cast<int>(hz));
  if (all.size() == 1) {
    json.update(to_json(all.front()));
  } else {
    for (const MeasuredPlace& measured : all) {
      const Vec3& at_m = measured.place.at_m;
      nlohmann::ordered_json one = {{"name", measured.place.name},
                                    {"listener_m", std::array{at_m.x, at_m.y, at_m.z}}};
      one.update(to_json(measured));
      json["places"].push_back(std::move(one));
    }
  }
  return printable_json(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

}  // namespace clamor
