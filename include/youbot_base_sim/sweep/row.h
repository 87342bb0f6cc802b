#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/record/recorder.h"
#include "youbot_base_sim/sweep/family.h"

namespace youbot_base_sim {

/// What became of a run.
enum class RunStatus : char { kDone = 'd', kDoubtful = 'u', kRefused = 'r', kFailed = 'f' };

/// The row that a run has in the table of its family.
struct Row {
  std::uint64_t run = 0;
  RunStatus status = RunStatus::kDone;
  std::string text;  ///< a line of CSV without its end; begins with the run's number
};

/// Makes the rows of a family, and the trajectories that it keeps. May be used by several threads at once.
class RowMaker {
 public:
  using MakeRecorder = std::function<std::unique_ptr<Recorder>(OutputFile file)>;

  /// Trajectories go into `folder`; `make_bag` is empty where bags cannot be written.
  RowMaker(const Family& family, std::string folder, MakeRecorder make_bag);

  /// The table's first line: run, the axes' keys, status, reliable, quantities, reason.
  std::string header() const;

  /// Simulates a run. Its row says what is wrong with it, if anything. Throws Stopped once `stop` is set, and
  /// OutputError where its trajectory cannot be written.
  Row make(std::uint64_t run, const std::atomic<bool>& stop) const;

  /// Keeps the places of all trajectories. Throws OutputError where one leads to a file that is read, or to that of
  /// another output.
  void keep_trajectories(OutputOpener& opener) const;

 private:
  bool keeps_trajectory(std::uint64_t run) const;
  std::string trajectory_name(std::uint64_t run) const;
  std::unique_ptr<Recorder> open_trajectory(std::uint64_t run) const;
  std::string simulate(const Scene& scene, const std::unique_ptr<Recorder>& trajectory, const std::atomic<bool>& stop,
                       std::string& reason) const;

  const Family& family_;
  std::string folder_;
  MakeRecorder make_bag_;
};

/// The least and the largest value of each quantity over the rows that have one, how far these are apart, mean and
/// standard deviation.
class Spread {
 public:
  explicit Spread(const Family& family);

  /// Rows are to be added in the order of their runs, so that the sums are always rounded alike.
  void add(const Row& row);

  /// A table for people; empty if there are no values.
  std::string text() const;

 private:
  struct Column {
    std::string name;
    std::size_t index;                               // among the cells of a row
    double min = 0, max = 0, mean = 0, squares = 0;  // sum of (value - mean)^2
  };
  std::vector<Column> columns_;
  std::uint64_t count_ = 0;
};

}  // namespace youbot_base_sim
