// output_stream.h: opens and closes a device with its feed on threads that may hang.
//
// Threads: the supervisor's. All others are internal.
#pragma once

#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/output/audio_output.h"
#include "runtime/output/device_feed.h"

namespace clamor {

// The output is destroyed first, because it calls the feed.
struct OutputStream {
  OutputDevice device;
  std::shared_ptr<DeviceFeed> feed;
  std::unique_ptr<AudioOutput> output;
};

// A request that the supervisor repeats until a device opens.
struct StreamRequest {
  OutputRequest output;
  // Reopen exactly this device; otherwise resolve the request's name.
  std::optional<OutputDevice> again;
  std::shared_ptr<CallbackGate> gate;
  std::uint32_t id = 0;
};

struct OpenedStream {
  enum class Failure { kNone, kNoSuchDevice, kDoesNotOpen };

  Failure failure = Failure::kNone;
  std::string problem;
  OutputStream stream;
};

// Opens and starts one device on a separate thread. The started device already calls its feed,
// which gives silence until the gate admits it. Destroying the future abandons the attempt: a
// device that opens later is closed at once.
std::future<OpenedStream> begin_opening(std::shared_ptr<OutputDriver> driver,
                                        StreamRequest request);

// Closes streams, each on a separate thread.
class StreamClosing {
 public:
  void close(OutputStream stream);

  // Waits for all closings that are not known to hang, but no longer than `time`.
  void wait_for(std::chrono::milliseconds time);

  // Number of closings that have ever hung, including those that began longer than `time` ago and
  // still run.
  std::uint64_t hung(std::chrono::milliseconds time);

 private:
  struct Begun {
    std::future<void> done;
    std::chrono::steady_clock::time_point at;
    bool hung = false;
  };

  std::vector<Begun> begun_;
  std::uint64_t hung_ = 0;
};

}  // namespace clamor
