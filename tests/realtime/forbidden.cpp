// forbidden.cpp: these functions replace the C library's functions of the same names.
#include "tests/realtime/forbidden.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);
}

namespace {

thread_local int forbidden = 0;

// Syscall User Dispatch (Linux, Documentation/admin-guide/syscall-user-dispatch.rst): before each
// system call of the thread the kernel checks this byte, and sends SIGSYS if it is set. Reads from
// the vDSO, such as the clock, are no system calls.
#ifndef PR_SET_SYSCALL_USER_DISPATCH
#define PR_SET_SYSCALL_USER_DISPATCH 59
#endif
constexpr unsigned long kDispatchOn = 1;
constexpr char kAllow = 0, kBlock = 1;
thread_local volatile char selector = kAllow;

void check(const char* name) {
  if (forbidden == 0) return;
  selector = kAllow;
  forbidden = 0;  // abort() may do anything
  const auto put = [](const char* text) {
    if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) std::_Exit(1);
  };
  put("forbidden on the audio thread: ");
  put(name);
  put("\n");
  std::abort();
}

// The C library's own function, looked up before anything is forbidden.
template <class Function>
Function* own(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

auto* const own_lock = own<int(pthread_mutex_t*)>("pthread_mutex_lock");
auto* const own_wait = own<int(pthread_cond_t*, pthread_mutex_t*)>("pthread_cond_wait");
auto* const own_sem_wait = own<int(sem_t*)>("sem_wait");
auto* const own_nanosleep = own<int(const timespec*, timespec*)>("nanosleep");
auto* const own_read_lock = own<int(pthread_rwlock_t*)>("pthread_rwlock_rdlock");
auto* const own_write_lock = own<int(pthread_rwlock_t*)>("pthread_rwlock_wrlock");

void on_system_call(int, siginfo_t* what, void*) {
  std::array<char, 32> text{};
  const char* const before = "system call ";
  std::size_t at = std::strlen(before);
  std::memcpy(text.data(), before, at);
  for (int unit = 100, number = what->si_syscall; unit > 0; unit /= 10)
    text[at++] = static_cast<char>('0' + number / unit % 10);
  check(text.data());
}

// Checked each time, since a process that forks loses the setting.
bool dispatch_system_calls() {
  static const bool has_handler = [] {
    struct sigaction action {};
    action.sa_sigaction = on_system_call;
    action.sa_flags = SA_SIGINFO;
    return ::sigaction(SIGSYS, &action, nullptr) == 0;
  }();
  return has_handler && ::prctl(PR_SET_SYSCALL_USER_DISPATCH, kDispatchOn, 0UL, 0UL,
                                const_cast<char*>(&selector)) == 0;
}

}  // namespace

namespace clamor::testing {

Forbidden::Forbidden() {
  if (forbidden == 0 && dispatch_system_calls()) selector = kBlock;
  ++forbidden;
}
Forbidden::~Forbidden() {
  if (--forbidden == 0) selector = kAllow;
}

bool Forbidden::watches_system_calls() { return dispatch_system_calls(); }

long page_faults() {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

}  // namespace clamor::testing

extern "C" {

void* malloc(std::size_t size) {
  check("malloc");
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  check("calloc");
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  check("realloc");
  return __libc_realloc(block, size);
}
void free(void* block) {
  check("free");
  __libc_free(block);
}
void* memalign(std::size_t alignment, std::size_t size) {
  check("memalign");
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  check("aligned_alloc");
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  check("posix_memalign");
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  check("pthread_mutex_lock");
  // Constructors of libraries lock before this file's functions are resolved; there is only one
  // thread then.
  return own_lock == nullptr ? 0 : own_lock(mutex);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  check("pthread_rwlock_rdlock");
  return own_read_lock == nullptr ? 0 : own_read_lock(lock);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  check("pthread_rwlock_wrlock");
  return own_write_lock == nullptr ? 0 : own_write_lock(lock);
}
int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
  check("pthread_cond_wait");
  return own_wait(condition, mutex);
}
int sem_wait(sem_t* semaphore) {
  check("sem_wait");
  return own_sem_wait(semaphore);
}
int nanosleep(const timespec* wanted, timespec* left) {
  check("nanosleep");
  return own_nanosleep(wanted, left);
}
}
