#include "tools/commands/impulse_json.h"

#include <utility>

#include "common/bands.h"
#include "tools/analysis/room_parameters.h"
#include "tools/program/json_values.h"

namespace clamor {

namespace {

OrderedJson figures_of(const MeasuredPlace& measured) {
  OrderedJson json = {{"energy", measured.of_energy},
                      {"waveform", measured.of_waveform},
                      {"warnings", OrderedJson::array()}};
  if (measured.warning) json["warnings"].push_back(*measured.warning);
  return json;
}

}  // namespace

std::string impulse_json(std::span<const MeasuredPlace> all) {
  OrderedJson json;
  for (const double hz : kBandCentres_hz) json["bands_hz"].push_back(static_cast<int>(hz));
  if (all.size() == 1) {
    json.update(figures_of(all.front()));
  } else {
    for (const MeasuredPlace& measured : all) {
      OrderedJson one = {{"name", measured.place.name},
                         {"listener_m", as_json(measured.place.at_m)}};
      one.update(figures_of(measured));
      json["places"].push_back(std::move(one));
    }
  }
  return json_text(json);
}

}  // namespace clamor
