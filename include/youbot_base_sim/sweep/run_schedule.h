#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <vector>

#include "youbot_base_sim/sweep/journal.h"

namespace youbot_base_sim {

/// Hands out the runs that are not finished, and enters their rows into the journal as they come. For several
/// threads at once.
class RunSchedule {
 public:
  /// `journal` must outlive this.
  RunSchedule(Journal& journal, std::uint64_t runs) : journal_(journal), runs_(runs) {}

  /// Finishes the runs, or what others leave of them, on `threads` more threads. Calls `watch` every `interval` on this
  /// one, which may stop the schedule. Throws what was thrown there or here, which stops all.
  void run(const RowMaker& maker, int threads, std::chrono::milliseconds interval, const std::function<void()>& watch);

  /// The next runs, at most `max_count`; none where none are left, where it is to stop, or while those that others
  /// work at hold up the rest (see FinishedRuns).
  std::vector<std::uint64_t> take(std::size_t max_count);

  /// Enters rows of runs that were taken. Throws OutputError.
  void finish(const std::vector<Row>& rows);

  /// Has nothing more handed out, and runs end early.
  void stop();

  bool finished() const;
  Tally tally() const;

 private:
  using Lock = std::unique_lock<std::mutex>;

  bool may_begin_next() const { return next_ < runs_ && journal_.finished().has_room_for(next_); }
  std::vector<std::uint64_t> take(const Lock&, std::size_t max_count);
  /// Takes runs and finishes them until there are no more or it is to stop.
  void work(const RowMaker& maker);
  /// Waits until all runs are finished or it is to stop, at most as long. Returns whether that is so.
  bool wait(std::chrono::milliseconds time) const;

  Journal& journal_;
  std::uint64_t runs_;
  std::uint64_t next_ = 0;  // all before were handed out or found finished
  std::atomic<bool> stopping_{false};
  mutable std::mutex mutex_;  // of all this, and of the journal but for its `sync`
  mutable std::condition_variable changed_;
};

}  // namespace youbot_base_sim
