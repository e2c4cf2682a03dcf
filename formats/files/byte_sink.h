// byte_sink.h: where a file of known layout is written: to disk (atomic_file.h) or into memory.
#pragma once

#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/result.h"

namespace clamor {

class ByteSink {
 public:
  ByteSink() = default;
  ByteSink(const ByteSink&) = default;
  ByteSink& operator=(const ByteSink&) = default;
  virtual ~ByteSink() = default;

  virtual const std::string& path() const = 0;  // for messages
  virtual Result<void> write(std::span<const std::byte> bytes) = 0;

  // Replaces bytes that were written before.
  virtual Result<void> write_at(std::size_t offset, std::span<const std::byte> bytes) = 0;
};

class MemorySink final : public ByteSink {
 public:
  explicit MemorySink(std::string name) : name_(std::move(name)) {}

  const std::string& path() const override { return name_; }
  Result<void> write(std::span<const std::byte> bytes) override {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Result<void> write_at(std::size_t offset, std::span<const std::byte> bytes) override {
    assert(offset + bytes.size() <= bytes_.size());
    std::memcpy(bytes_.data() + offset, bytes.data(), bytes.size());
    return {};
  }

  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::string name_;
  std::vector<std::byte> bytes_;
};

// Passes all on to another sink, until it is told to stop; then writing is an Error.
class StoppableSink final : public ByteSink {
 public:
  // `stop` may be null.
  StoppableSink(ByteSink& sink, const std::atomic<bool>* stop) : sink_(sink), stop_(stop) {}

  const std::string& path() const override { return sink_.path(); }
  Result<void> write(std::span<const std::byte> bytes) override {
    return stopped() ? Error("stopped before the file was complete") : sink_.write(bytes);
  }
  Result<void> write_at(std::size_t offset, std::span<const std::byte> bytes) override {
    return stopped() ? Error("stopped before the file was complete")
                     : sink_.write_at(offset, bytes);
  }

 private:
  bool stopped() const { return stop_ != nullptr && stop_->load(std::memory_order_relaxed); }

  ByteSink& sink_;
  const std::atomic<bool>* stop_;
};

}  // namespace clamor
