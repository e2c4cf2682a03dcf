// process.cpp: processes and their libraries by POSIX.
#include "common/platform/process.h"

#include <array>
#include <cerrno>
#include <cstdlib>

#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

namespace clamor {

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

int process_id() { return ::getpid(); }

bool has_ended(int process) { return ::kill(process, 0) != 0 && errno == ESRCH; }

std::optional<std::string> make_temporary_folder(std::string pattern) {
  if (::mkdtemp(pattern.data()) == nullptr) return std::nullopt;
  return pattern;
}

void call_in_forks(void (*counts)()) { ::pthread_atfork(nullptr, nullptr, counts); }

std::vector<std::string> program_arguments(int argc, char** argv) {
  return {argv + (argc > 0 ? 1 : 0), argv + argc};
}

void prepare_to_write() {
  // If a standard descriptor is closed, the next opened file would get its number, and messages
  // would be written into it. Placeholders prevent that, and fail like closed descriptors.
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(number, F_GETFD) < 0)
      (void)::open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  // Beyond `ulimit -f`, a write should fail with an error.
  ::signal(SIGXFSZ, SIG_IGN);
}

void* loaded_library(std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (void* const library = ::dlopen(name, RTLD_NOW | RTLD_LOCAL)) return library;
  return nullptr;
}

void* symbol_in(void* library, const char* name) {
  return ::dlsym(library != nullptr ? library : RTLD_DEFAULT, name);
}

}  // namespace clamor
