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

/// The outcome of a run.
enum class RunStatus : char { kDone = 'd', kDoubtful = 'u', kRefused = 'r', kFailed = 'f' };

/// The row of a run in the table.
struct Row {
  std::uint64_t run = 0;
  RunStatus status = RunStatus::kDone;
  std::string text;  ///< a line of CSV without its end; begins with the run's number

  /// For Boost.Serialization, by which ranks send rows.
  template <class Archive>
  void serialize(Archive& archive, unsigned /*version*/) {
    archive& run& status& text;
  }
};

class FinishedTable;

/// Makes the rows and trajectories of a family. Thread-safe.
class RowMaker {
 public:
  using MakeRecorder = std::function<std::unique_ptr<Recorder>(OutputFile file)>;

  /// Trajectories go into `folder`; without ROS `make_bag` is empty.
  RowMaker(const Family& family, std::string folder, MakeRecorder make_bag);

  /// The table's first line: run, the axes' keys, status, reliable, quantities, reason.
  std::string header() const;

  /// The cells of a run's axes, each after a comma.
  std::string axis_cells(std::uint64_t run) const;

  /// Takes the rows of runs whose trajectory is not kept from `table`, where it has them. It must outlive this.
  void take_from(const FinishedTable& table) { finished_ = &table; }

  /// Simulates a run; its row reports errors. Throws Stopped once `stop` is set, and OutputError of its trajectory.
  Row make(std::uint64_t run, const std::atomic<bool>& stop) const;

  /// Throws OutputError if a trajectory would replace a file that is read or another output.
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
  const FinishedTable* finished_ = nullptr;
};

/// Minimum, maximum, range, mean and standard deviation of each quantity over the rows that have it.
class Spread {
 public:
  explicit Spread(const Family& family);

  /// Call it in the order of runs, so that rounding does not vary.
  void add(const Row& row);

  /// A table to print; empty if there are no values.
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
