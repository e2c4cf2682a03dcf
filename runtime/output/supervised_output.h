// supervised_output.h: an output that goes on whatever its device does.
//
// While a device plays, a supervisor watches that it asks for sound, and neither for too much. When
// the device is unplugged, its server dies or it hangs, sound goes to a clock that keeps time in
// silence, so that time, keyframes and recording go on as if nothing had happened; meanwhile the
// device is opened anew, at first after 0.1 s, then less and less often, at last twice a second.
//
//             lost                                        answered
//   device ──────────> clock, device closing  ··tries··> ──────────> device, fading in
//
// Opening and closing may hang with whatever hung the device (RtAudio 5.2.0 does on PulseAudio), so
// each happens on a thread of its own that nobody waits for longer than kPatience. Never two
// openings at once: drivers keep tables without locks. A hanging one is waited for while the
// clock goes on; at the end it is abandoned, with all that it may still touch.
//
// Threads: all members on one; statistics() on any.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "common/result.h"
#include "runtime/output/audio_output.h"
#include "runtime/realtime/callback_timing.h"

namespace clamor {

struct OutputStatistics {
  CallbackTiming::Counters callbacks;  // of all devices and the clock
  std::string device;                  // the one that plays, or last played
  bool has_device = false;             // false: the clock keeps time
  int rate_hz = 0, block_frames = 0;   // the device's
  bool resamples = false;
  double latency_s = 0;  // from the mixer to the loudspeaker, as the device says; 0: not known
  std::uint64_t losses = 0, reopenings = 0;
  std::uint64_t failed_openings = 0;
  std::uint64_t hung_closings = 0;  // given up on
  double without_device_s = 0;      // in all
  double without_device_now_s = 0;  // this time
  double longest_without_s = 0;
  std::string problem;          // why there is no device, as was found the last time
  std::string opening_problem;  // why the last opening that failed did
};

class SupervisedOutput {
 public:
  static constexpr auto kPatience = std::chrono::seconds(1);  // with a call that does not return

  // Opens the device that `request` means. Errors: there is none, or more than one; a device that
  // is there and cannot be opened is tried again and again. "none" is the clock alone.
  static Result<std::unique_ptr<SupervisedOutput>> open(std::shared_ptr<OutputDriver> driver,
                                                        const OutputRequest& request,
                                                        OutputCallback callback);
  ~SupervisedOutput();  // stops

  void start();

  // When it returns, the callback has returned for the last time, even if a device hangs.
  void stop();

  OutputStatistics statistics() const;

 private:
  struct State;
  explicit SupervisedOutput(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
