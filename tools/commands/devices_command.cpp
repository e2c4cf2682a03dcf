// devices_command.cpp: clamor devices: lists the sound devices.
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "common/sample_rate.h"
#include "runtime/output/audio_output.h"
#include "runtime/output/device_selection.h"
#include "tools/analysis/json_values.h"
#include "tools/commands/commands.h"
#include "tools/program/arguments.h"

namespace clamor {

int run_devices(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  bool json = false;
  Arguments parser("devices", "Lists the sound devices that 'clamor play --device NAME' can use.",
                   "clamor devices --json");
  parser.flag("--json", json, "print a list of objects; the list is empty without a device");
  if (const auto code = parser.parse(arguments, out, err)) return *code;

  const auto devices = sound_devices()->devices("");
  if (json) {
    OrderedJson list = OrderedJson::array();
    for (const OutputDevice& device : devices)
      list.push_back({{"api", device.api},
                      {"name", device.name},
                      {"output_channels", device.output_channels},
                      {"rates_hz", device.rates_hz},
                      {"default", device.is_default}});
    out << json_text(list) << '\n';
    return kSuccess;
  }
  for (const OutputDevice& device : devices) {
    const auto rates = rates_to_try(device, 0);
    fmt::print(out, "{}  ({} channels, {:g} kHz{}{})\n", device.full_name(), device.output_channels,
               rates.front() / 1e3, rates.front() == kSampleRate_hz ? "" : ", resampled",
               device.is_default ? ", default" : "");
  }
  if (devices.empty())
    fmt::print(err,
               "no sound device; 'clamor play --device none' plays in silence, 'clamor render' "
               "writes a WAV file\n");
  return kSuccess;
}

}  // namespace clamor
