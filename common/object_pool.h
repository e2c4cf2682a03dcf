// object_pool.h: lends objects that are costly to make, such as large buffers, to one user each.
//
// A new object is made when none is idle. Objects of `thread_local` storage would be one per
// thread, too, but MinGW frees that storage when a thread ends before it calls their destructors.
//
// Threads: borrow() may be called, and what it lends given back, on any thread. A lock is held for
// a few instructions, so this is for work of microseconds and more.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <vector>

namespace clamor {

template <class T>
class ObjectPool {
  struct GiveBack {
    ObjectPool* pool;
    void operator()(T* object) const {
      const std::lock_guard lock(pool->mutex_);
      pool->idle_.push_back(object);  // has room for all
    }
  };

 public:
  // An object as its last user left it, given back by the pointer's destructor.
  std::unique_ptr<T, GiveBack> borrow() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) {
      idle_.reserve(objects_.size() + 1);
      idle_.push_back(&objects_.emplace_back());
    }
    T* const object = idle_.back();
    idle_.pop_back();
    return {object, {this}};
  }

 private:
  std::mutex mutex_;
  std::deque<T> objects_;
  std::vector<T*> idle_;
};

}  // namespace clamor
