// shared_while_used.h: hands out one value to all who want it at a time.
//
// Threads: any; who comes while the value is made waits for it.
#pragma once

#include <memory>
#include <mutex>

namespace clamor {

class SharedWhileUsed {
 public:
  // The value that somebody holds, or else make(), which returns a std::shared_ptr<T>. All callers
  // must want the same type.
  template <class T, class Make>
  std::shared_ptr<T> get(const Make& make) {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<T> value = std::static_pointer_cast<T>(value_.lock());
    if (value == nullptr) value_ = value = make();
    return value;
  }

 private:
  std::mutex mutex_;
  std::weak_ptr<void> value_;
};

}  // namespace clamor
