// telling_context.h: a context of the C interface that keeps what it tells the application.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/clamor.h"
#include "tests/library/library_room.h"

namespace clamor::testing {

struct Told {
  std::mutex mutex;
  std::map<std::string, int> begun, ended;
  std::vector<std::string> sentences;
};

// `told` must outlive the context.
inline Context context_that_tells(Told& told, bool caller_updates) {
  clamor_options options{};
  options.bytes = sizeof(options);
  options.caller_updates = caller_updates;
  options.user = &told;
  options.log = [](void* user, const char* sentence) {
    auto& into = *static_cast<Told*>(user);
    const std::lock_guard lock(into.mutex);
    into.sentences.emplace_back(sentence);
  };
  options.thread_begins = [](void* user, const char* name) {
    auto& into = *static_cast<Told*>(user);
    const std::lock_guard lock(into.mutex);
    ++into.begun[name];
  };
  options.thread_ends = [](void* user, const char* name) {
    auto& into = *static_cast<Told*>(user);
    const std::lock_guard lock(into.mutex);
    ++into.ended[name];
  };
  clamor_context* context = nullptr;
  EXPECT_EQ(clamor_create(&options, &context, nullptr), CLAMOR_OK);
  return Context(context);
}

}  // namespace clamor::testing
