// program.h: a program that runs beside a test.
#pragma once

#include <cstdlib>
#include <string>
#include <vector>

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace clamor::testing {

// Starts a program with its output in a file. It is killed on destruction, or when the test dies.
class Program {
 public:
  Program(const std::vector<std::string>& words, const std::string& output) {
    std::vector<char*> pointers;
    for (const auto& word : words) pointers.push_back(const_cast<char*>(word.c_str()));
    pointers.push_back(nullptr);
    const std::string errors = output + ".log";
    id_ = ::fork();
    if (id_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);  // a crashing test leaves no process behind
    ::dup2(::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
    ::dup2(::open(errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
    ::execvp(pointers[0], pointers.data());
    ::_exit(127);
  }
  ~Program() { stop(); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  // False once it has ended.
  bool runs() const {
    siginfo_t ended{};
    return id_ > 0 &&
           ::waitid(P_PID, static_cast<id_t>(id_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == 0;
  }

  void signal(int number) { ::kill(id_, number); }

  // Kills it if it has not ended ten seconds after the signal.
  void stop(int number = SIGTERM) {
    if (id_ <= 0) return;
    signal(number);
    for (int i = 0; i < 1000 && runs(); ++i) ::usleep(10'000);
    signal(SIGKILL);
    ::waitpid(id_, nullptr, 0);
    id_ = -1;
  }

 private:
  pid_t id_ = -1;
};

}  // namespace clamor::testing
