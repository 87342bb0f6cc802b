#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <vector>

#include "temporary_folder.h"

namespace youbot_base_sim {

/// A program that a test starts, which runs beside it.
class Program {
 public:
  Program(const std::string& path, const std::vector<std::string>& arguments) {
    const std::string out = folder_.path("out"), err = folder_.path("err");
    std::vector<char*> argv{const_cast<char*>(path.c_str())};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    id_ = fork();
    if (id_ != 0) return;
    redirect(STDIN_FILENO, "/dev/null", O_RDONLY);
    redirect(STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC);
    redirect(STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC);
    alarm(kTimeLimit);
    execv(path.c_str(), argv.data());
    _exit(127);
  }
  ~Program() {
    if (ended_) return;
    kill();
    wait();
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// Waits for its end. Returns the exit status; -1 if a signal ended it.
  int wait() {
    while (!ended_) ended_ = waitpid(id_, &status_, 0) == id_ || errno != EINTR;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
  }

  void kill() { send(SIGKILL); }
  pid_t id() const { return id_; }
  /// Without effect once it has been waited for.
  void send(int signal) {
    if (!ended_) ::kill(id_, signal);
  }

  // What it has printed so far.
  std::string out() const { return folder_.read("out"); }
  std::string err() const { return folder_.read("err"); }

 private:
#ifdef YOUBOT_BASE_SIM_SANITIZERS
  static constexpr unsigned kTimeLimit = 600;  // s, after which a signal ends a program that hangs
#else
  static constexpr unsigned kTimeLimit = 60;
#endif

  static void redirect(int stream, const char* path, int flags) { dup2(open(path, flags, 0666), stream); }

  TemporaryFolder folder_;
  pid_t id_;
  int status_ = 0;
  bool ended_ = false;
};

}  // namespace youbot_base_sim
