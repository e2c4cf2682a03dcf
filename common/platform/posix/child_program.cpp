// child_program.cpp: programs by posix_spawn().
#include "common/platform/child_program.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace clamor {

std::optional<int> start_program(const std::string& command, const std::string& log) {
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(),
                                     O_WRONLY | O_CREAT | O_APPEND, 0644);
  ::posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  std::string shell = "sh", option = "-c", line = "exec " + command;
  std::array<char*, 4> words{shell.data(), option.data(), line.data(), nullptr};
  pid_t child = 0;
  const int failed = ::posix_spawn(&child, "/bin/sh", &actions, nullptr, words.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed == 0) return child;
  errno = failed;
  return std::nullopt;
}

void ask_to_end(int process) { ::kill(process, SIGTERM); }

std::optional<EndedProgram> next_ended_program() {
  int status = 0;
  const pid_t ended = ::waitpid(-1, &status, WNOHANG);
  if (ended <= 0) return std::nullopt;
  std::string signal;
  if (WIFSIGNALED(status))
    signal = std::to_string(WTERMSIG(status)) + " (" + ::strsignal(WTERMSIG(status)) + ")";
  return EndedProgram{ended, status == 0, signal};
}

ProgramOutput run_program(const std::string& command) {
  ProgramOutput output;
  FILE* const pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return output;
  std::array<char, 4096> some{};
  while (const std::size_t got = std::fread(some.data(), 1, some.size(), pipe))
    output.text.append(some.data(), got);
  output.ok = ::pclose(pipe) == 0;
  while (output.text.ends_with('\n')) output.text.pop_back();
  return output;
}

}  // namespace clamor
