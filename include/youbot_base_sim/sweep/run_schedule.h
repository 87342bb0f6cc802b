#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <vector>

#include "youbot_base_sim/sweep/journal.h"

namespace youbot_base_sim {

/// Makes the row of a run, on whatever thread or rank. Throws Stopped once `stop` is set.
using MakeRow = std::function<Row(std::uint64_t run, const std::atomic<bool>& stop)>;

/// Hands out the runs that are not finished, and enters their rows into the journal as they come. For several
/// threads at once.
class RunSchedule {
 public:
  /// `journal` must outlive this.
  RunSchedule(Journal& journal, std::uint64_t runs) : journal_(journal), runs_(runs) {}

  /// The next runs, at most `max_count`; none where none are left, where it is to stop, or while those that others
  /// work at hold up the rest (see FinishedRuns).
  std::vector<std::uint64_t> take(std::size_t max_count);

  /// Enters rows of runs that were taken. Throws OutputError.
  void finish(const std::vector<Row>& rows);

  /// Takes runs and finishes them on the calling thread until there are no more or it is to stop. What is thrown
  /// meanwhile stops all, and `check` throws it again.
  void work(const MakeRow& make);

  /// Has nothing more handed out, and runs end early.
  void stop();

  /// Waits until all runs are finished or it is to stop, at most as long. Returns whether that is so.
  bool wait(std::chrono::milliseconds time) const;

  void check() const;

  bool finished() const;
  Tally tally() const;

 private:
  using Lock = std::unique_lock<std::mutex>;

  bool may_begin_next() const { return next_ < runs_ && journal_.finished().has_room_for(next_); }
  std::vector<std::uint64_t> take(const Lock&, std::size_t max_count);
  bool ended() const { return stopping_ || journal_.tally().runs == runs_; }

  Journal& journal_;
  std::uint64_t runs_;
  std::uint64_t next_ = 0;  // all before were handed out or found finished
  std::atomic<bool> stopping_{false};
  std::exception_ptr failure_;
  mutable std::mutex mutex_;  // of all this, and of the journal but for its `sync`
  mutable std::condition_variable changed_;
};

/// Finishes a schedule, or what others leave of it, on `threads` more threads. Calls `watch` every `interval` on this
/// one, which may stop the schedule. Throws what was thrown there or here.
void work_on_threads(RunSchedule& schedule, const MakeRow& make, int threads, std::chrono::milliseconds interval,
                     const std::function<void()>& watch);

}  // namespace youbot_base_sim
