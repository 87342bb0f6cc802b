#pragma once

#include <dirent.h>
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

namespace youbot_base_sim {

/// A process of this machine and user, and whether it is at work, by what Linux shows in /proc.
///
/// The thread that asks does not count. A process that has ended, whether its parent has taken notice or not, sleeps.
class Process {
 public:
  /// Throws std::system_error, as all below, where this process may open no more files.
  explicit Process(pid_t id);
  Process(Process&&) noexcept;
  Process& operator=(Process&&) noexcept;
  ~Process();

  /// True if all of its threads wait for something or have ended.
  bool sleeps();

  /// True if a signal or a debugger has stopped one of its threads.
  bool is_stopped();

  /// A number that changes whenever a thread of it has run; one that runs just now may count later. Takes longer to
  /// know for this process.
  std::uint64_t work_so_far();

  /// Marks a moment at which it rests, for `learn_polls` and `has_late_poll`.
  void mark();

  /// Learns which threads poll, that is, look at the time once a millisecond: those that have run that often since the
  /// mark, time `since` ago, though all was at rest. A thread that is new or begins a sleep counts as polling until it
  /// proves not to.
  void learn_polls(std::chrono::nanoseconds since);

  /// True if a thread that polls has not run since the mark.
  bool has_late_poll() const;

 private:
  class Thread;

  void find_threads();

  pid_t id_;
  std::unique_ptr<DIR, int (*)(DIR*)> folder_;  // of its threads in /proc
  std::vector<Thread> threads_;                 // but the one that asks
};

/// The processes of this machine that listen at a TCP port; of those that may be looked into: this user's.
std::vector<Process> processes_listening_at(std::uint32_t port);

}  // namespace youbot_base_sim
