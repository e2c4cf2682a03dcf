// supervised_output.h: an output that keeps running when its device fails.
//
// A supervisor thread checks that the device requests sound, and not too much of it. When the
// device is unplugged, its server dies or it hangs, a silent clock takes over, so that time,
// keyframes and recording continue. Meanwhile the supervisor tries to reopen the device, at first
// after 0.1 s, then less often, at last twice a second.
//
//             lost                                        answered
//   device ──────────> clock, device closing  ··tries··> ──────────> device, fading in
//
// Opening and closing may hang together with the device (RtAudio 5.2.0 does on PulseAudio), so each
// runs on a separate thread that nobody waits for longer than kPatience. Two openings never run at
// once: drivers keep tables without locks. The clock runs while an opening hangs; in the end the
// thread is abandoned with everything that it may still touch.
//
// Threads: all members on one thread; statistics() on any.
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
  std::string device;                  // the current or the last one
  bool has_device = false;             // false: the clock keeps time
  int rate_hz = 0, block_frames = 0;   // of the device
  bool resamples = false;
  double latency_s = 0;  // from the mixer to the loudspeaker, as the device reports it; 0: unknown
  std::uint64_t losses = 0, reopenings = 0;
  std::uint64_t failed_openings = 0;
  std::uint64_t hung_closings = 0;  // abandoned
  double without_device_s = 0;      // total
  double without_device_now_s = 0;  // current period
  double longest_without_s = 0;
  std::string problem;          // why there is no device, as last found
  std::string opening_problem;  // why the last failed opening failed
};

class SupervisedOutput {
 public:
  static constexpr auto kPatience = std::chrono::seconds(1);  // with a call that does not return

  // Opens the device that `request` names. Errors: no device matches, or more than one. A device
  // that exists but cannot be opened is tried again and again. The name "none" selects the clock
  // alone.
  static Result<std::unique_ptr<SupervisedOutput>> open(std::shared_ptr<OutputDriver> driver,
                                                        const OutputRequest& request,
                                                        OutputCallback callback);
  ~SupervisedOutput();  // stops

  void start();

  // Returns after the last callback has returned, even if a device hangs.
  void stop();

  OutputStatistics statistics() const;

 private:
  struct State;
  explicit SupervisedOutput(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clamor
