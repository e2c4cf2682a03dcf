// child_program.cpp: no other programs, whose commands are those of a POSIX shell.
#include "common/platform/child_program.h"

#include <cerrno>

namespace clamor {

std::optional<int> start_program(const std::string&, const std::string&) {
  errno = ENOSYS;
  return std::nullopt;
}

void ask_to_end(int) {}

std::optional<EndedProgram> next_ended_program() { return std::nullopt; }

ProgramOutput run_program(const std::string&) {
  return {false, "no shell runs commands on this system"};
}

}  // namespace clamor
