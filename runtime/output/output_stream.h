// output_stream.h: opens and closes a device with its feed on threads that may hang.
//
// Threads: the supervisor's. All others are internal.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

#include "common/result.h"
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

// Opens and starts one device on a separate thread. The started device already calls its feed,
// which gives silence until the gate admits it. Destruction abandons the attempt: a device that
// opens later is closed at once.
class StreamOpening {
 public:
  enum class Failure { kNone, kNoSuchDevice, kDoesNotOpen };

  StreamOpening(std::shared_ptr<OutputDriver> driver, StreamRequest request);
  ~StreamOpening();
  StreamOpening(const StreamOpening&) = delete;
  StreamOpening& operator=(const StreamOpening&) = delete;

  bool wait_for(std::chrono::milliseconds time);  // true when done
  Failure failure() const;                        // this and all below: only when done
  std::string problem() const;
  OutputStream take();

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

// Closes streams, each on a separate thread.
class StreamClosing {
 public:
  StreamClosing();

  void close(OutputStream stream);

  // Waits for all closings that are not known to hang, but no longer than `time`.
  void wait_for(std::chrono::milliseconds time);

  // Number of closings that have ever hung, including those that began longer than `time` ago and
  // still run.
  std::uint64_t hung(std::chrono::milliseconds time);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace clamor
