#include "runtime/output/output_stream.h"

#include <algorithm>
#include <thread>
#include <vector>

#include "runtime/output/device_selection.h"

namespace clamor {

struct OpenedStream {
  StreamOpening::Failure failure = StreamOpening::Failure::kNone;
  std::string problem;
  OutputStream stream;
};

namespace {

using Clock = std::chrono::steady_clock;

OpenedStream failed(StreamOpening::Failure failure, const Error& error) {
  return {failure, error.message, {}};
}

OpenedStream open_stream(OutputDriver& driver, const StreamRequest& request) {
  using Failure = StreamOpening::Failure;
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

}  // namespace

struct StreamOpening::Shared {
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false, abandoned = false;
  OpenedStream opened;
};

StreamOpening::StreamOpening(std::shared_ptr<OutputDriver> driver, StreamRequest request)
    : shared_(std::make_shared<Shared>()) {
  std::thread([shared = shared_, driver = std::move(driver), request = std::move(request)] {
    OpenedStream opened = open_stream(*driver, request);
    const std::lock_guard lock(shared->mutex);
    if (shared->abandoned) return;  // `opened` closes
    shared->opened = std::move(opened);
    shared->done = true;
    shared->changed.notify_all();
  }).detach();
}

StreamOpening::~StreamOpening() {
  const std::lock_guard lock(shared_->mutex);
  shared_->abandoned = true;
}

bool StreamOpening::wait_for(std::chrono::milliseconds time) {
  std::unique_lock lock(shared_->mutex);
  return shared_->changed.wait_for(lock, time, [this] { return shared_->done; });
}

StreamOpening::Failure StreamOpening::failure() const { return shared_->opened.failure; }
std::string StreamOpening::problem() const { return shared_->opened.problem; }
OutputStream StreamOpening::take() { return std::move(shared_->opened.stream); }

struct StreamClosing::Shared {
  struct Begun {
    std::uint64_t number;
    Clock::time_point at;
    bool hung = false;
  };

  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Begun> begun;
  std::uint64_t number = 0, hung = 0;
};

StreamClosing::StreamClosing() : shared_(std::make_shared<Shared>()) {}

void StreamClosing::close(OutputStream stream) {
  if (stream.output == nullptr) return;
  const std::lock_guard lock(shared_->mutex);
  const std::uint64_t number = shared_->number++;
  shared_->begun.push_back({number, Clock::now()});
  std::thread([shared = shared_, number, closed = std::move(stream)]() mutable {
    closed.output.reset();
    closed.feed.reset();
    const std::lock_guard inner(shared->mutex);
    std::erase_if(shared->begun, [&](const auto& begun) { return begun.number == number; });
    shared->changed.notify_all();
  }).detach();
}

void StreamClosing::wait_for(std::chrono::milliseconds time) {
  std::unique_lock lock(shared_->mutex);
  shared_->changed.wait_for(lock, time, [this] {
    return std::all_of(shared_->begun.begin(), shared_->begun.end(),
                       [](const auto& begun) { return begun.hung; });
  });
}

std::uint64_t StreamClosing::hung(std::chrono::milliseconds time) {
  const std::lock_guard lock(shared_->mutex);
  for (auto& begun : shared_->begun)
    if (!begun.hung && Clock::now() - begun.at > time) {
      begun.hung = true;
      ++shared_->hung;
    }
  return shared_->hung;
}

}  // namespace clamor
