// device_selection.h: resolves a user's device name and lists the sample rates to try.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/output/audio_output.h"

namespace clamor {

// Finds the device meant by `wanted`, ignoring case:
//
//   ""             the default of the first API that has one (PulseAudio, JACK, ALSA)
//   "jack"         an API's default; API names never match a part of another name
//   "alsa: hw:1"   a device's full name, its name, a prefix of either, or a substring
//
// The first of these rules that matches exactly one device decides. Errors list the devices.
Result<OutputDevice> choose_device(std::span<const OutputDevice> devices,
                                   const std::string& wanted);

// An error about a device ("does not start (...)") that ends with advice.
Error device_error(const std::string& device, const std::string& what);

// Sample rates to try, best first: only `wanted_hz` if it is not 0; otherwise 48 kHz if the device
// has it, then higher rates, which lose nothing, then lower ones.
std::vector<int> rates_to_try(const OutputDevice& device, int wanted_hz);

}  // namespace clamor
