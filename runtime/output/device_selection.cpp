#include "runtime/output/device_selection.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <functional>
#include <utility>

#include "common/sample_rate.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxExpandedSources = 6;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

using Devices = std::vector<const OutputDevice*>;

Devices those_that(std::span<const OutputDevice> devices,
                   const std::function<bool(const OutputDevice&)>& fit) {
  Devices found;
  for (const OutputDevice& device : devices)
    if (fit(device)) found.push_back(&device);
  return found;
}

std::string listed(const Devices& devices) {
  std::string text;
  for (std::size_t i = 0; i < devices.size() && i < kMaxExpandedSources; ++i)
    text += (i == 0 ? "" : ", ") + in_quotes(devices[i]->full_name());
  if (devices.size() > kMaxExpandedSources)
    text += " and " + std::to_string(devices.size() - kMaxExpandedSources) + " more";
  return text;
}

// The default device among them, or else the first.
const OutputDevice& preferred(const Devices& devices) {
  const auto is_default = [](const OutputDevice* device) { return device->is_default; };
  const auto found = std::find_if(devices.begin(), devices.end(), is_default);
  return **(found == devices.end() ? devices.begin() : found);
}

// Name of the software behind an API, for error messages.
struct ApiName {
  const char *name, *is_missing;
};
constexpr std::array<ApiName, 4> kApiNames = {
    {{"pulse", "no PulseAudio server is running; start one"},
     {"jack", "no JACK server is running; start one"},
     {"alsa", "ALSA finds no sound card; connect one"},
     {"wasapi", "WASAPI finds no sound card; connect one"}}};

}  // namespace

Result<OutputDevice> choose_device(std::span<const OutputDevice> devices,
                                   const std::string& wanted) {
  const Devices all = those_that(devices, [](const OutputDevice&) { return true; });
  const std::string name = lower(wanted);
  if (const auto api = std::ranges::find(kApiNames, name, &ApiName::name); api != kApiNames.end()) {
    const Devices of_api =
        those_that(devices, [&](const OutputDevice& device) { return device.api == name; });
    if (!of_api.empty()) return preferred(of_api);
    return Error(std::string(api->is_missing) +
                 (all.empty() ? ", or use --device none to play in silence"
                              : ", or name another device: there is " + listed(all)));
  }
  if (all.empty())
    return Error(
        "there is no sound device; start a sound server, use --device none to play in silence, or "
        "'clamor render' to write a WAV file");
  if (wanted.empty()) return preferred(all);

  const std::array<std::function<bool(const OutputDevice&)>, 3> fits = {
      [&](const OutputDevice& device) {
        return lower(device.full_name()) == name || lower(device.name) == name;
      },
      [&](const OutputDevice& device) {
        return lower(device.full_name()).starts_with(name) || lower(device.name).starts_with(name);
      },
      [&](const OutputDevice& device) {
        return lower(device.full_name()).find(name) != std::string::npos;
      }};
  for (const auto& fit : fits) {
    const Devices found = those_that(devices, fit);
    if (found.size() == 1) return *found.front();
    if (found.size() > 1)
      return Error(in_quotes(wanted) + " may mean " + std::to_string(found.size()) +
                   " sound devices: " + listed(found) + "; write more of the name");
  }
  return Error("no sound device is called " + in_quotes(wanted) + "; there is " + listed(all) +
               ", as 'clamor devices' prints");
}

Error device_error(const std::string& device, const std::string& what) {
  return Error("the sound device " + in_quotes(device) + " " + what +
               "; name another of 'clamor devices' with --device");
}

std::vector<int> rates_to_try(const OutputDevice& device, int wanted_hz) {
  if (wanted_hz > 0) return {wanted_hz};
  std::vector<int> rates(device.rates_hz.begin(), device.rates_hz.end());
  if (rates.empty()) return {kSampleRate_hz};
  // From ours upwards, and then from ours downwards.
  std::ranges::sort(rates, {}, [](int rate) {
    return std::pair(rate < kSampleRate_hz, std::abs(rate - kSampleRate_hz));
  });
  return rates;
}

}  // namespace clamor
