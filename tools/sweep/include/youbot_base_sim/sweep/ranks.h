#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "youbot_base_sim/sweep/journal.h"

namespace youbot_base_sim {

/// The processes of one sweep under `mpirun`. Rank 0 has the journal and hands out runs. This base class is one alone.
class Ranks {
 public:
  Ranks() = default;
  virtual ~Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  virtual int rank() const { return 0; }
  virtual int size() const { return 1; }

  /// Each rank's text, on all ranks; all of them must call it.
  virtual std::vector<std::string> gather(const std::string& text) const { return {text}; }

  /// Receives the progress so far; returns whether to continue.
  using Watch = std::function<bool(const Tally& tally)>;

  /// Rank 0: finishes the runs that the journal lacks, on `threads` threads if it is alone, else together with the
  /// other ranks. Calls `watch` on this thread at least ten times a second; when it returns false, runs end early and
  /// stay unfinished. An exception from a run or from `watch` ends it too, and is rethrown.
  virtual void serve(Journal& journal, const RowMaker& maker, int threads, const Watch& watch);

  /// The other ranks: make rows until rank 0 has no more runs.
  virtual void work(const RowMaker&) {}

  /// Ends all other ranks, too, in the middle of their runs.
  virtual void abort(int) const {}
};

/// The ranks that an MPI launcher started, or this process alone. Throws std::runtime_error under one without MPI.
std::unique_ptr<Ranks> join_ranks(int& argc, char**& argv);

}  // namespace youbot_base_sim
