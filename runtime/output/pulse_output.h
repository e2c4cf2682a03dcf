// pulse_output.h: sinks of a PulseAudio server, or of PipeWire where it stands in for one.
//
// PulseAudio's own library is asked, not RtAudio: RtAudio 5.2.0 never tells that the server ran
// dry, which is heard as a gap, knows no latency, and hangs when it is closed on a server that
// hangs. Here the server's underflow messages are counted, the buffer grows where they repeat
// (buffer_growth.h), and latency is what the server says a sample takes to the loudspeaker.
//
// Each stream has a thread of its own, which writes whole blocks as the server asks for them. No
// call waits for the server for longer than two seconds.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "runtime/output/audio_output.h"

namespace clamor {

// Sinks with two channels or more, called by their descriptions. None where no server answers.
std::vector<OutputDevice> pulse_devices();

// Null where it cannot be opened, and why in `problem`.
std::unique_ptr<AudioOutput> open_pulse(const OutputDevice& device, const OutputRequest& request,
                                        OutputCallback callback, std::string& problem);

}  // namespace clamor
