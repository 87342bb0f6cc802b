#pragma once

#include <dirent.h>
#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace youbot_base_sim {

/// A process of this machine and user, and whether it is at work, by what Linux shows in /proc.
///
/// The thread that asks does not count. A process that has ended, whether its parent has taken notice or not, sleeps.
class Process {
 public:
  explicit Process(pid_t id);
  Process(Process&&) noexcept;
  Process& operator=(Process&&) noexcept;
  ~Process();

  /// Whether all of its threads wait for something or have ended.
  bool sleeps();

  /// Whether a signal or a debugger has stopped one of its threads.
  bool is_stopped();

  /// A number that grows whenever a thread of it runs. Takes longer to know for this process.
  std::uint64_t work_so_far();

  /// Marks a moment at which it is at rest, for `learn_polls` and `has_late_poll`.
  void mark();

  /// Learns which threads poll: they have run again, though all was at rest. Call it as long after each mark as they
  /// usually sleep between two polls. A thread that is new or begins to sleep for a given time is taken to poll until
  /// it is seen not to.
  void learn_polls();

  /// Whether a thread that polls has not run since the mark.
  bool has_late_poll() const;

 private:
  class Thread;

  void find_threads();

  pid_t id_;
  std::unique_ptr<DIR, int (*)(DIR*)> folder_;  // of its threads in /proc
  std::vector<Thread> threads_;
};

/// The processes of this machine that listen at a TCP port; of those that may be looked into: this user's.
std::vector<Process> processes_listening_at(std::uint32_t port);

}  // namespace youbot_base_sim
