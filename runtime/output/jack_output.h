// jack_output.h: sound devices of a JACK server, or of PipeWire in its place.
//
// Uses libjack directly: RtAudio's JACK layer (5.2.0 and 6.0) fails permanently when the server's
// block size changes, hangs when it is closed after that, and writes to standard error when the
// server stops.
//
// An input port of another JACK client is a channel here, and a client with such ports is a device.
// The server alone decides the block size and the sample rate.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "runtime/output/audio_output.h"

namespace clamor {

// Clients with two channels or more. Hardware comes first, and the first of all is the default.
// Empty if no server runs; none is started.
std::vector<OutputDevice> jack_devices();

// Plays on the device's first channels. Null if the device is gone, has too few channels or runs at
// another rate than the requested one; `problem` tells which.
std::unique_ptr<AudioOutput> open_jack(const OutputDevice& device, const OutputRequest& request,
                                       OutputCallback callback, std::string& problem);

}  // namespace clamor
