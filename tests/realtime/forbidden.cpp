// The functions here stand before the C library's own of the same names.
#include "tests/realtime/forbidden.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
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

void check(const char* name) {
  if (forbidden == 0) return;
  forbidden = 0;  // abort() may do as it likes
  const auto put = [](const char* text) {
    if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) std::_Exit(1);
  };
  put("forbidden on the audio thread: ");
  put(name);
  put("\n");
  std::abort();
}

// The C library's own function, found before anything is forbidden.
template <class Function>
Function* own(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

auto* const own_lock = own<int(pthread_mutex_t*)>("pthread_mutex_lock");
auto* const own_wait = own<int(pthread_cond_t*, pthread_mutex_t*)>("pthread_cond_wait");
auto* const own_sem_wait = own<int(sem_t*)>("sem_wait");
auto* const own_nanosleep = own<int(const timespec*, timespec*)>("nanosleep");

}  // namespace

namespace clamor::testing {
Forbidden::Forbidden() { ++forbidden; }
Forbidden::~Forbidden() { --forbidden; }
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
  // Constructors of libraries lock before this file's own are found; they are alone then.
  return own_lock == nullptr ? 0 : own_lock(mutex);
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
