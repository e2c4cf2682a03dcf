// jack_output.h: sound devices of a JACK server, or of PipeWire where it stands in for one.
//
// JACK's own library is asked, not RtAudio, whose layer above it (5.2.0 and 6.0) gives up for good
// when the server's block size changes, hangs when it is closed after that, and writes to standard
// error when the server stops.
//
// What JACK calls a port of another client that takes sound is a channel here, and a client with
// such ports a device. The server alone says how long blocks are, and at which rate.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "runtime/output/audio_output.h"

namespace clamor {

// Clients with two channels or more; those of the hardware come first, and the first of them all is
// the default. None where no server runs: it is not started.
std::vector<OutputDevice> jack_devices();

// Plays on its first channels; null where it is gone, has too few, or its server runs at another
// rate than the one that is asked for, as `problem` then says.
std::unique_ptr<AudioOutput> open_jack(const OutputDevice& device, const OutputRequest& request,
                                       OutputCallback callback, std::string& problem);

}  // namespace clamor
