// thread_hooks.h: tells an application of the threads that the library keeps.
#pragma once

#include "common/platform/thread.h"

namespace clamor {

// Functions of the application's, or null. Each is called on the thread itself.
struct ThreadHooks {
  void (*begins)(void* user, const char* name) = nullptr;
  void (*ends)(void* user, const char* name) = nullptr;
  void* user = nullptr;
};

// Names the calling thread, and calls the hooks as it begins and ends.
class HookedThread {
 public:
  HookedThread(const ThreadHooks& hooks, const char* name) : hooks_(hooks), name_(name) {
    name_thread(name);
    if (hooks.begins != nullptr) hooks.begins(hooks.user, name);
  }
  ~HookedThread() {
    if (hooks_.ends != nullptr) hooks_.ends(hooks_.user, name_);
  }
  HookedThread(const HookedThread&) = delete;
  HookedThread& operator=(const HookedThread&) = delete;

 private:
  const ThreadHooks hooks_;
  const char* const name_;
};

}  // namespace clamor
