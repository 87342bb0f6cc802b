#pragma once

#include <signal.h>
#include <unistd.h>

#include <boost/process/args.hpp>
#include <boost/process/child.hpp>
#include <boost/process/extend.hpp>
#include <boost/process/io.hpp>
#include <string>
#include <vector>

#include "temporary_folder.h"

namespace youbot_base_sim {

/// A program that a test starts, which runs beside it.
class Program {
 public:
  Program(const std::string& path, const std::vector<std::string>& arguments)
      : child_(path, boost::process::args(arguments),
               boost::process::std_in<boost::process::null, boost::process::std_out> folder_.path("out"),
               boost::process::std_err > folder_.path("err"),
               boost::process::extend::on_exec_setup([](auto&) { alarm(kTimeLimit); })) {}

  /// Waits for its end. Returns the exit status; -1 if a signal ended it.
  int wait() {
    child_.wait();
    return WIFEXITED(child_.native_exit_code()) ? child_.exit_code() : -1;
  }

  void kill() { child_.terminate(); }
  pid_t id() const { return child_.id(); }
  void send(int signal) { ::kill(child_.id(), signal); }

  // What it has printed so far.
  std::string out() const { return folder_.read("out"); }
  std::string err() const { return folder_.read("err"); }

 private:
  static constexpr unsigned kTimeLimit = 60;  // s, after which a signal ends a program that hangs

  TemporaryFolder folder_;
  boost::process::child child_;
};

}  // namespace youbot_base_sim
