#include "runtime/output/output_stream.h"

#include <thread>
#include <utility>

#include "runtime/output/device_selection.h"

namespace clamor {

namespace {

using Clock = std::chrono::steady_clock;
using Failure = OpenedStream::Failure;

OpenedStream failed(Failure failure, const Error& error) { return {failure, error.message, {}}; }

OpenedStream open_stream(OutputDriver& driver, const StreamRequest& request) {
  const auto devices = driver.devices(request.again ? request.again->api : "");
  auto chosen =
      choose_device(devices, request.again ? request.again->full_name() : request.output.device);
  if (!chosen.ok()) return failed(Failure::kNoSuchDevice, chosen.error());
  // A name that is a prefix of another must not find the other device instead.
  if (request.again && chosen->full_name() != request.again->full_name())
    return failed(Failure::kNoSuchDevice,
                  Error(in_quotes(request.again->full_name()) + " is gone"));

  OpenedStream opened;
  opened.stream.device = *chosen;
  opened.stream.feed =
      std::make_shared<DeviceFeed>(request.gate, request.id, request.output.channels);
  auto output = driver.open(*chosen, request.output, opened.stream.feed->callback());
  if (!output.ok()) {
    opened.failure = Failure::kDoesNotOpen;
    opened.problem = output.error().message;
    return opened;
  }
  opened.stream.output = std::move(*output);
  AudioOutput& device = *opened.stream.output;
  auto done = opened.stream.feed->prepare(device.rate_hz(), device.block_frames());
  if (done.ok()) done = device.start();
  if (done.ok()) return opened;
  return failed(Failure::kDoesNotOpen, done.error());
}

// Runs `work` on a thread that nobody waits for if it hangs.
template <class Result, class Work>
std::future<Result> on_separate_thread(Work work) {
  std::packaged_task<Result()> task(std::move(work));
  auto result = task.get_future();
  std::thread(std::move(task)).detach();
  return result;
}

}  // namespace

std::future<OpenedStream> begin_opening(std::shared_ptr<OutputDriver> driver,
                                        StreamRequest request) {
  return on_separate_thread<OpenedStream>(
      [driver = std::move(driver), request = std::move(request)] {
        return open_stream(*driver, request);
      });
}

void StreamClosing::close(OutputStream stream) {
  if (stream.output == nullptr) return;
  auto done = on_separate_thread<void>([closed = std::move(stream)]() mutable {
    closed.output.reset();
    closed.feed.reset();
  });
  begun_.push_back({std::move(done), Clock::now()});
}

void StreamClosing::wait_for(std::chrono::milliseconds time) {
  const auto end = Clock::now() + time;
  for (const Begun& begun : begun_)
    if (!begun.hung) begun.done.wait_until(end);
}

std::uint64_t StreamClosing::hung(std::chrono::milliseconds time) {
  const auto now = Clock::now();
  std::erase_if(begun_, [now](const Begun& begun) {
    return begun.done.wait_until(now) == std::future_status::ready;
  });
  for (Begun& begun : begun_)
    if (!begun.hung && now - begun.at > time) {
      begun.hung = true;
      ++hung_;
    }
  return hung_;
}

}  // namespace clamor
