// child_program.h: runs other programs by the shell.
//
// Threads: one at a time, which is told of the ends of its programs.
#pragma once

#include <optional>
#include <string>

namespace clamor {

// Starts a command that appends both of its outputs to `log`. Returns its process, or nothing with
// the reason in errno.
std::optional<int> start_program(const std::string& command, const std::string& log);

void ask_to_end(int process);

struct EndedProgram {
  int process = 0;
  bool is_ok = false;
  std::string signal;  // that ended it, if one did: "9 (Killed)"
};

// One that has ended since the last call, if any. Does not wait.
std::optional<EndedProgram> next_ended_program();

struct ProgramOutput {
  bool ok = false;
  std::string text;  // of both streams, without its last line ends
};

// Waits for a command's end.
ProgramOutput run_program(const std::string& command);

}  // namespace clamor
