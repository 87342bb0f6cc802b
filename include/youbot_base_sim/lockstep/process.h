#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace youbot_base_sim {

/// A process of this machine and user, and whether it is at work, by what Linux shows in /proc.
///
/// The thread that asks does not count. A process that has ended, whether its parent has taken notice or not, rests.
class Process {
 public:
  /// Throws std::system_error, as all below, where this process may open no more files.
  explicit Process(pid_t id);
  Process(Process&&) noexcept;
  Process& operator=(Process&&) noexcept;
  ~Process();
  pid_t id() const { return id_; }  ///< its number

  /// True if there was an instant at which all of its threads waited for something or had ended.
  bool rests();

  /// True if a signal or a debugger has stopped it, as far as threads have been looked at.
  bool is_stopped() const;

  /// Threads but the one that asks, as far as they have been looked for.
  std::size_t threads() const;

  /// A number that changes whenever a thread of it has run; one that runs just now may count later. Takes longer to
  /// know for this process.
  std::uint64_t work_so_far();

  /// Marks a moment at which it has been seen to rest, for `learn_polls` and `has_late_poll`; only if it `learns`, also
  /// for threads that have proved not to poll. Returns true if a thread may poll.
  bool mark(bool learns = true);

  /// Learns which threads poll, that is, look at the time once a millisecond: those that have run that often since the
  /// mark, time `since` ago, though all was at rest. A thread that is new or begins a sleep counts as polling until it
  /// proves not to.
  void learn_polls(std::chrono::nanoseconds since);

  /// True if a thread that polls has not run since the mark.
  bool has_late_poll() const;

 private:
  class Thread;

  bool some_have_ended() const;
  void find_threads();

  pid_t id_;
  bool is_own_;
  clockid_t clock_ = -1;         // of its time on processors; -1: none
  std::vector<Thread> threads_;  // but the one that asks
  std::size_t awake_ = 0;        // the thread that was last seen at work; their number: none
  std::uint64_t work_ = 0;       // when it was last looked at
  bool rested_ = false;          // then
};

/// Packets that have been sent over the loopback device.
std::uint64_t packets_over_loopback();

}  // namespace youbot_base_sim
