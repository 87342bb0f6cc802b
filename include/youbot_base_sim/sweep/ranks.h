#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "youbot_base_sim/sweep/journal.h"

namespace youbot_base_sim {

/// The processes by which `mpirun` runs one sweep, on one machine or several. Rank 0 has the journal and hands out
/// runs, and works at them too; the others only work. As this class has it, this process is alone.
class Ranks {
 public:
  Ranks() = default;
  virtual ~Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  virtual int rank() const { return 0; }
  virtual int size() const { return 1; }

  /// Each rank's text, for all ranks; to be called by all of them.
  virtual std::vector<std::string> gather(const std::string& text) const { return {text}; }

  /// Receives the progress so far; returns whether to continue.
  using Watch = std::function<bool(const Tally& tally)>;

  /// Rank 0: finishes the runs that the journal lacks, on `threads` threads if it is alone, else together with the
  /// other ranks. Calls `watch` on this thread ten times a second; once that returns false, runs end early and stay
  /// unfinished. Throws what was thrown at the work or by `watch`, which ends it too.
  virtual void serve(Journal& journal, const RowMaker& maker, int threads, const Watch& watch);

  /// The other ranks: make rows until rank 0 has no more for them.
  virtual void work(const RowMaker&) {}

  /// Ends all ranks at once, also those amid a run.
  [[noreturn]] virtual void abort(int status) const { std::exit(status); }
};

/// The ranks that mpirun, or another launcher that MPI knows, has started; without one this process alone. Throws
/// std::runtime_error where there is one and this program was built without MPI.
std::unique_ptr<Ranks> join_ranks(int& argc, char**& argv);

}  // namespace youbot_base_sim
