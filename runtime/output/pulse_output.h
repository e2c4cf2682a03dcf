// pulse_output.h: sinks of a PulseAudio server, or of PipeWire in its place.
//
// Uses libpulse directly: RtAudio 5.2.0 never reports underflows, which are audible gaps, knows no
// latency, and hangs when it is closed while the server hangs. Here underflow messages are counted,
// the buffer grows if they repeat (buffer_growth.h), and the latency is the server's own figure to
// the loudspeaker.
//
// Each stream has a thread that writes whole blocks on the server's request. No call waits for the
// server longer than two seconds.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "runtime/output/audio_output.h"

namespace clamor {

// Sinks with two channels or more, named by their descriptions. Empty if no server answers.
std::vector<OutputDevice> pulse_devices();

// Null if the sink cannot be opened, with the reason in `problem`.
std::unique_ptr<AudioOutput> open_pulse(const OutputDevice& device, const OutputRequest& request,
                                        OutputCallback callback, std::string& problem);

}  // namespace clamor
