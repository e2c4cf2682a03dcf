// Wraps functions of the C library to make them fail.
#include "tests/faults/fault_injection.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cinttypes>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <optional>

#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

namespace clamor::testing {

namespace {

struct Now {
  FaultPlan plan;
  long calls = 0;  // that could fail
  bool struck = false;
  std::vector<std::string> log;
};

std::mutex mutex;
std::optional<Now> now;
std::atomic<bool> any{false};  // keeps calls cheap without a plan

std::string path_of(int descriptor) {
  std::array<char, 4096> path{};
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const auto length = ::readlink(link.c_str(), path.data(), path.size());
  return length > 0 ? std::string(path.data(), static_cast<std::size_t>(length)) : "";
}

// Path of the file mapped at an address; "" for none.
std::string path_at(const void* address) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t begin = 0, end = 0;
    if (std::sscanf(line.c_str(), "%" SCNxPTR "-%" SCNxPTR, &begin, &end) != 2) continue;
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    if (at < begin || at >= end) continue;
    const auto slash = line.find('/');
    return slash == std::string::npos ? "" : line.substr(slash);
  }
  return "";
}

bool lies_in(const std::string& path, const std::string& folder) {
  return path.starts_with(folder) && (path.size() == folder.size() || path[folder.size()] == '/');
}

bool is_among(const std::string& call, const std::string& calls) {
  return calls.empty() || (" " + calls + " ").find(" " + call + " ") != std::string::npos;
}

bool is_this_thread(const std::string& thread) {
  std::array<char, 16> name{};
  return thread.empty() || (::pthread_getname_np(::pthread_self(), name.data(), name.size()) == 0 &&
                            thread == name.data());
}

enum class Verdict { kGoOn, kFail, kHalf };

Verdict verdict_on(const char* call, const std::string& path) {
  std::unique_lock lock(mutex);
  if (!now || !lies_in(path, now->plan.folder)) return Verdict::kGoOn;
  now->log.push_back(std::string(call) + " " + std::filesystem::path(path).filename().string());
  if (!is_among(call, now->plan.calls) || !is_this_thread(now->plan.thread)) return Verdict::kGoOn;
  const long index = now->calls++;
  const bool stays = now->plan.fate == FaultKind::kPersistentFailure ||
                     now->plan.fate == FaultKind::kRunCallbackFromThenOn;
  if (now->plan.fail_at_call < 0 || index < now->plan.fail_at_call) return Verdict::kGoOn;
  if (index > now->plan.fail_at_call && !stays) return Verdict::kGoOn;
  now->struck = true;
  if (now->plan.fate == FaultKind::kRunCallback ||
      now->plan.fate == FaultKind::kRunCallbackFromThenOn) {
    const auto meanwhile = now->plan.meanwhile;
    lock.unlock();  // the callback may make calls of its own
    meanwhile();
    return Verdict::kGoOn;
  }
  if (now->plan.fate == FaultKind::kPartialTransfer) return Verdict::kHalf;
  errno = now->plan.error;
  return Verdict::kFail;
}

Verdict verdict_on(const char* call, int descriptor) {
  if (!any.load(std::memory_order_relaxed)) return Verdict::kGoOn;
  const int before = errno;
  const std::string path = path_of(descriptor);
  errno = before;
  return verdict_on(call, path);
}

template <class Function>
Function* own(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

// A call on a descriptor that returns 0 or -1.
template <class Do>
int decide(const char* call, int descriptor, const Do& go_on) {
  return verdict_on(call, descriptor) == Verdict::kFail ? -1 : go_on();
}

// A call that transfers bytes.
template <class Do>
ssize_t decide(const char* call, int descriptor, std::size_t bytes, const Do& go_on) {
  switch (verdict_on(call, descriptor)) {
    case Verdict::kFail:
      return -1;
    case Verdict::kHalf:
      return go_on((bytes + 1) / 2);
    default:
      return go_on(bytes);
  }
}

}  // namespace

FaultInjection::FaultInjection(FaultPlan plan) {
  const std::lock_guard lock(mutex);
  now.emplace();
  now->plan = std::move(plan);
  any = true;
}

FaultInjection::~FaultInjection() {
  const std::lock_guard lock(mutex);
  any = false;
  now.reset();
}

bool FaultInjection::struck() const {
  const std::lock_guard lock(mutex);
  return now->struck;
}

std::vector<std::string> FaultInjection::log() const {
  const std::lock_guard lock(mutex);
  return now->log;
}

long count_of(const std::vector<std::string>& log, std::string_view beginning) {
  return std::count_if(log.begin(), log.end(),
                       [&](const std::string& line) { return line.starts_with(beginning); });
}

}  // namespace clamor::testing

using namespace clamor::testing;

extern "C" {

int open(const char* path, int flags, ...) {
  static auto* const own_open = own<int(const char*, int, ...)>("open");
  va_list list;
  va_start(list, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
  va_end(list);
  if (any.load(std::memory_order_relaxed) &&
      verdict_on((flags & O_DIRECTORY) != 0 ? "open-folder" : "open", std::string(path)) ==
          Verdict::kFail)
    return -1;
  return own_open(path, flags, mode);
}

ssize_t read(int descriptor, void* to, std::size_t bytes) {
  static auto* const own_read = own<ssize_t(int, void*, std::size_t)>("read");
  return decide("read", descriptor, bytes,
                [&](std::size_t count) { return own_read(descriptor, to, count); });
}

ssize_t pread(int descriptor, void* to, std::size_t bytes, off_t offset) {
  static auto* const own_pread = own<ssize_t(int, void*, std::size_t, off_t)>("pread");
  return decide("pread", descriptor, bytes,
                [&](std::size_t count) { return own_pread(descriptor, to, count, offset); });
}

// madvise() on a mapped file announces that its pages are about to be read, so it counts as a read.
int madvise(void* address, std::size_t bytes, int advice) noexcept {
  static auto* const own_madvise = own<int(void*, std::size_t, int)>("madvise");
  if (advice == MADV_WILLNEED && any.load(std::memory_order_relaxed) &&
      verdict_on("madvise", path_at(address)) == Verdict::kFail)
    return -1;
  return own_madvise(address, bytes, advice);
}

ssize_t write(int descriptor, const void* from, std::size_t bytes) {
  static auto* const own_write = own<ssize_t(int, const void*, std::size_t)>("write");
  return decide("write", descriptor, bytes,
                [&](std::size_t count) { return own_write(descriptor, from, count); });
}

ssize_t pwrite(int descriptor, const void* from, std::size_t bytes, off_t offset) {
  static auto* const own_pwrite = own<ssize_t(int, const void*, std::size_t, off_t)>("pwrite");
  return decide("pwrite", descriptor, bytes,
                [&](std::size_t count) { return own_pwrite(descriptor, from, count, offset); });
}

// Nothing is really synced, because tests write thousands of files that need not survive.
int fsync(int descriptor) {
  return decide("fsync", descriptor, [] { return 0; });
}

int fdatasync(int descriptor) {
  return decide("fdatasync", descriptor, [] { return 0; });
}

int ftruncate(int descriptor, off_t length) noexcept {
  static auto* const own_ftruncate = own<int(int, off_t)>("ftruncate");
  return decide("ftruncate", descriptor, [&] { return own_ftruncate(descriptor, length); });
}

int rename(const char* from, const char* to) noexcept {
  static auto* const own_rename = own<int(const char*, const char*)>("rename");
  if (any.load(std::memory_order_relaxed) &&
      verdict_on("rename", std::string(to)) == Verdict::kFail)
    return -1;
  return own_rename(from, to);
}

// The descriptor is closed whatever close() returns, as on Linux.
int close(int descriptor) {
  static auto* const own_close = own<int(int)>("close");
  const Verdict verdict = verdict_on("close", descriptor);
  const int error = errno, closed = own_close(descriptor);
  if (verdict != Verdict::kFail) return closed;
  errno = error;
  return -1;
}
}
