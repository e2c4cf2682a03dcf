// output_stream.h: a device with its feed, opened and closed on threads that may hang.
//
// Threads: those of the supervisor; what runs on others is inside.
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

// The output goes first, since it calls the feed.
struct OutputStream {
  OutputDevice device;
  std::shared_ptr<DeviceFeed> feed;
  std::unique_ptr<AudioOutput> output;
};

// What to open, again and again.
struct StreamRequest {
  OutputRequest output;
  std::optional<OutputDevice> again;  // this one and no other; else the one that is asked for
  std::shared_ptr<CallbackGate> gate;
  std::uint32_t id = 0;
};

// One opening, on a thread of its own, and the start: what comes out calls its feed already, which
// gives silence until the gate is given to it. Abandoned when this goes: what is opened after that
// is closed at once.
class StreamOpening {
 public:
  enum class Failure { kNone, kChoice, kDevice };  // is there no such device, or does it not open

  StreamOpening(std::shared_ptr<OutputDriver> driver, StreamRequest request);
  ~StreamOpening();
  StreamOpening(const StreamOpening&) = delete;
  StreamOpening& operator=(const StreamOpening&) = delete;

  bool wait_for(std::chrono::milliseconds time);  // true when it is done
  Failure failure() const;                        // all below: when it is done
  std::string problem() const;
  OutputStream take();

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

// Closes streams, each on a thread of its own.
class StreamClosing {
 public:
  StreamClosing();

  void close(OutputStream stream);

  // Waits until all are closed that are not known to hang, but not longer than that.
  void wait_for(std::chrono::milliseconds time);

  // Closings that began longer ago than that and have not ended hang. How many ever did.
  std::uint64_t hung(std::chrono::milliseconds time);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace clamor
