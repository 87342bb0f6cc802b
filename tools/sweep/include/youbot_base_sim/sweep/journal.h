#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "youbot_base_sim/sweep/row.h"

namespace youbot_base_sim {

/// Runs from `begin` to before `end`.
struct RunRange {
  std::uint64_t begin, end;
  std::uint64_t size() const { return end - begin; }
  bool contains(std::uint64_t run) const { return run >= begin && run < end; }
};

/// The finished runs: all before `first_open`, and some of the kWindow that follow. Its memory is bounded.
class FinishedRuns {
 public:
  static constexpr std::uint64_t kWindow = 1 << 16;

  explicit FinishedRuns(std::uint64_t first) : first_open_(first) {}

  std::uint64_t first_open() const { return first_open_; }
  /// True if a run is within the window.
  bool has_room_for(std::uint64_t run) const { return run < first_open_ + kWindow; }
  bool contains(std::uint64_t run) const { return run < first_open_ || ahead_.count(run) > 0; }
  /// Requires room for the run.
  void insert(std::uint64_t run);

 private:
  std::uint64_t first_open_;
  std::set<std::uint64_t> ahead_;
};

/// Counts of finished runs, in all and by how they ended.
struct Tally {
  std::uint64_t runs = 0, doubtful = 0, refused = 0, failed = 0;
  void add(RunStatus status);
};

/// The rows finished so far, in a file that survives any end: each row is appended at once as a line with a checksum.
/// They leave the order of runs by less than FinishedRuns::kWindow. One process writes it. Throws OutputError.
///
/// Lines rather than a database: SQLite takes ten times as long for a row, and does not find a flipped bit in one.
class Journal {
 public:
  /// Continues the journal at `path`, or begins it. A torn last line is dropped; the run of a damaged line is
  /// unfinished. OutputError if another process writes it, or for another `head`: the files that the rows depend on.
  Journal(const std::string& path, const std::vector<std::string>& head, const RunRange& runs);

  void append(const Row& row);

  /// Makes the rows so far survive a power failure. May be called while another thread appends.
  void sync();

  const RunRange& runs() const { return runs_; }
  bool is_complete() const { return tally_.runs == runs_.size(); }
  const FinishedRuns& finished() const { return finished_; }
  const Tally& tally() const { return tally_; }

  /// Calls `take` for all rows in the order of their runs, once all are finished.
  void for_each_row(const std::function<void(const Row& row)>& take) const;

  /// Deletes the file.
  void remove();

 private:
  /// Appends the text, or throws and leaves the file as it was; one without any text is deleted.
  void write(const std::string& text);
  void check_head(const std::vector<std::string>& head) const;
  void read_rows();

  std::string path_;
  RunRange runs_;
  Descriptor descriptor_;
  off_t begin_ = 0;  // of the rows, bytes
  off_t end_ = 0;
  FinishedRuns finished_;
  Tally tally_;
};

}  // namespace youbot_base_sim
