// clamor_context.h: the context behind the C interface, and what its functions share. Not
// installed.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

#include "common/c_structures.h"
#include "common/vec.h"
#include "runtime/clamor.h"
#include "runtime/clamor_fork.h"
#include "runtime/world/handle_table.h"
#include "runtime/world/world.h"

struct clamor_context {
  explicit clamor_context(const clamor_options& options)
      : caller_updates(options.caller_updates != 0),
        update_period_s(caller_updates ? options.update_period_s : 0),
        thread_hooks{options.thread_begins, options.thread_ends, options.user},
        report(options.log == nullptr ? clamor::World::Report()
                                      : [log = options.log, user = options.user](
                                            const char* sentence) { log(user, sentence); }),
        world({!caller_updates, options.max_sources, options.max_sounds, report, thread_hooks}) {}

  const std::uint32_t forks = clamor::interface::fork_count();
  const bool caller_updates;
  const double update_period_s;
  const clamor::ThreadHooks thread_hooks;
  const clamor::World::Report report;
  clamor::World world;
};

namespace clamor::interface {

constexpr double kMaxPosition_m = 1e9;

// Whether there is no context, or none of this process's: a child of fork() has no threads that
// would serve its parent's.
inline bool is_missing(const clamor_context* context) noexcept {
  return context == nullptr || context->forks != fork_count();
}

// Reads a pose within a limit; false if a number is out of range, or if the orientation has no
// length.
inline bool read_pose(const clamor_pose& given, double limit_m, Vec3& position_m,
                      Quaternion& rotation) {
  for (const double metre : given.position_m)
    if (!(std::abs(metre) <= limit_m)) return false;
  double square = 0;
  for (const double part : given.orientation) {
    if (!(std::abs(part) <= kMaxPosition_m)) return false;
    square += part * part;
  }
  const auto& [x, y, z, w] = given.orientation;
  position_m = {given.position_m[0], given.position_m[1], given.position_m[2]};
  rotation = Quaternion(w, x, y, z);
  return square > 1e-12;
}

// An object that the application lends with a release callback. The application keeps it if the
// call that takes it fails; otherwise it is released with its last owner.
class Loan {
 public:
  Loan(void* user, void (*release)(void* user))
      : owner_(nullptr, [is_kept = is_kept_, user, release](const void*) {
          if (*is_kept && release != nullptr) release(user);
        }) {}

  std::shared_ptr<const void> owner() const { return owner_; }
  // Call with the result of the call that takes it; returns that.
  clamor_result keep_after(clamor_result result) {
    *is_kept_ = result == CLAMOR_OK;
    return result;
  }

 private:
  const std::shared_ptr<bool> is_kept_ = std::make_shared<bool>(false);
  const std::shared_ptr<const void> owner_;
};

// Writes a failure where the caller wants it.
inline clamor_result fail(clamor_error* error, clamor_result code,
                          const std::string& sentence = "") {
  return write_failure(error, code, sentence.empty() ? clamor_result_text(code) : sentence);
}

// ARGUMENT of a function without a clamor_error: if a structure's size is to blame, the log is
// told.
template <class T>
clamor_result refuse(const clamor_context* context, const T* structure) {
  const std::string sentence = size_refusal(structure);
  if (!sentence.empty() && !is_missing(context) && context->report)
    context->report(sentence.c_str());
  return CLAMOR_ERROR_ARGUMENT;
}

// Runs what an interface function does; no exception leaves it.
template <class Act>
clamor_result guarded(clamor_error* error, const Act& act) noexcept {
  if (error != nullptr) *error = {};
  return without_exceptions(act, [error](bool is_memory, const char* sentence) {
    return fail(error, is_memory ? CLAMOR_ERROR_MEMORY : CLAMOR_ERROR_INTERNAL, sentence);
  });
}

// Calls act(file) with an open level.
template <class Act>
clamor_result in_level(clamor_context* context, clamor_level level, const Act& act) noexcept {
  return guarded(nullptr, [&]() -> clamor_result {
    if (is_missing(context)) return CLAMOR_ERROR_ARGUMENT;
    const auto file = context->world.level(level);
    return file == nullptr ? clamor_result{CLAMOR_ERROR_HANDLE} : act(*file);
  });
}

// Hands out the handle of a new object; 0 means that there are as many as there can be.
inline clamor_result hand_out(std::uint64_t handle, std::uint64_t* into,
                              clamor_error* error = nullptr) {
  if (handle == 0) return fail(error, CLAMOR_ERROR_FULL);
  *into = handle;
  return CLAMOR_OK;
}

// Enters the object of a handle on a thread that may not wait, and calls act(object).
template <class T, class Act>
clamor_result entered(HandleTable<T>& table, std::uint64_t handle, const Act& act) noexcept {
  using Entry = typename HandleTable<T>::Entry;
  T* object = nullptr;
  const Entry entry = table.enter(handle, object);
  if (entry == Entry::kUnknown) return CLAMOR_ERROR_HANDLE;
  if (entry == Entry::kBusy) return CLAMOR_ERROR_BUSY;
  const clamor_result result = act(*object);
  table.leave(handle);
  return result;
}

}  // namespace clamor::interface
