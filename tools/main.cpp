// main.cpp: the program `clamor`.
#include <csignal>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "common/printable.h"
#include "common/system_reason.h"
#include "tools/commands/commands.h"

namespace {

// If a standard descriptor is closed, the next opened file would get its number, and messages would
// be written into it. Placeholders prevent that, and fail like closed descriptors.
void occupy_standard_descriptors() {
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(number, F_GETFD) < 0)
      (void)::open("/dev/null", number == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

}  // namespace

int main(int argc, char** argv) {
  occupy_standard_descriptors();
  // Beyond `ulimit -f`, a write should fail with an error instead of killing the program.
  std::signal(SIGXFSZ, SIG_IGN);
  std::vector<std::string> arguments;
  for (int i = 1; i < argc; ++i) arguments.emplace_back(argv[i]);
  try {
    return clamor::run_clamor(arguments, std::cout, std::cerr);
  } catch (const std::bad_alloc&) {
    std::cerr << "clamor: out of memory; try fewer photons or voices, or a smaller level\n";
  } catch (const std::exception& exception) {
    std::cerr << "clamor: " << clamor::printable(clamor::system_reason(exception)) << '\n';
  }
  return clamor::kBadInput;
}
