// device_selection.h: which of the sound devices a name means, and at which rate to open it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/output/audio_output.h"

namespace clamor {

// The device meant by `wanted`, upper and lower case alike:
//
//   ""             the default of the first API that has one (PulseAudio, JACK, ALSA)
//   "jack"         an API's default, and never a part of another's name
//   "alsa: hw:1"   a device's full name, its name, how either begins, or a part of it
//
// The first of these that fits one device decides. Errors name what there is.
Result<OutputDevice> choose_device(std::span<const OutputDevice> devices,
                                   const std::string& wanted);

// Of a device and what is wrong with it ("does not start (...)"): with what to do about it.
Error device_error(const std::string& device, const std::string& what);

// Rates to try, best first: `wanted_hz` alone where it is given; else 48 kHz if the device has it,
// then those above it, which lose nothing, then those below.
std::vector<int> rates_to_try(const OutputDevice& device, int wanted_hz);

}  // namespace clamor
