#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/sweep/run_schedule.h"

namespace youbot_base_sim {

/// The processes by which `mpirun` runs one sweep, on one machine or several. Rank 0 has the journal and hands out
/// runs, and works at them too; the others only work. Without mpirun this process is alone.
class Ranks {
 public:
  /// Throws std::runtime_error where mpirun has started several and this program was built without MPI.
  Ranks(int& argc, char**& argv);
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const;
  int size() const;

  /// Each rank's text, for all ranks; to be called by all of them.
  std::vector<std::string> gather(const std::string& text) const;

  /// Rank 0: finishes the schedule together with the other ranks. Calls `watch` as work_on_threads does.
  void serve(RunSchedule& schedule, const MakeRow& make, std::chrono::milliseconds interval,
             const std::function<void()>& watch) const;

  /// The other ranks: make rows until rank 0 has no more for them.
  void work(const MakeRow& make) const;

  /// Ends all ranks at once, also those amid a run.
  [[noreturn]] void abort(int status) const;

 private:
  class Communicator;
  std::unique_ptr<Communicator> communicator_;  // null: alone
};

}  // namespace youbot_base_sim
