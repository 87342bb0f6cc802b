#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "youbot_base_sim/sweep/row.h"

namespace youbot_base_sim {

/// Which runs are finished: all before `first_open`, and some of the kWindow that follow. Takes the same memory for any
/// number of runs.
class FinishedRuns {
 public:
  static constexpr std::uint64_t kWindow = 1 << 16;

  std::uint64_t first_open() const { return first_open_; }
  /// Whether a run may be finished: others must not stay so far behind it that it would be too much to remember.
  bool has_room_for(std::uint64_t run) const { return run < first_open_ + kWindow; }
  bool contains(std::uint64_t run) const { return run < first_open_ || ahead_.count(run) > 0; }
  /// One for which there is room.
  void insert(std::uint64_t run);

 private:
  std::uint64_t first_open_ = 0;
  std::set<std::uint64_t> ahead_;
};

/// How many runs are finished, and how they ended.
struct Tally {
  std::uint64_t runs = 0, doubtful = 0, refused = 0, failed = 0;
  void add(RunStatus status);
};

/// The rows of a table under way, in a file that survives whatever ends the program: it is only ever appended to, a
/// line for each row as its run is finished, with a checksum. The rows of one table come in the order of their runs,
/// but for displacements by less than FinishedRuns::kWindow.
///
/// Lines rather than a database: SQLite takes ten times as long for a row, and does not find a flipped bit in one.
///
/// One process at a time writes it. Throws OutputError where the system refuses.
class Journal {
 public:
  /// Continues the journal at `path`, or begins it. A torn line at the end is dropped; a line that was damaged
  /// counts for nothing, and its run as not finished. Throws OutputError if another process writes it,
  /// or does not begin with `head`, whose lines list what the rows depend on: the error says which of them differs.
  Journal(const std::string& path, const std::vector<std::string>& head, std::uint64_t runs);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  void append(const Row& row);

  /// Sees that what was appended survives a power failure. May be called beside `append` by another thread.
  void sync();

  std::uint64_t runs() const { return runs_; }
  bool is_complete() const { return tally_.runs == runs_; }
  const FinishedRuns& finished() const { return finished_; }
  const Tally& tally() const { return tally_; }

  /// All rows in the order of their runs. To be called once all runs are finished.
  void for_each_row(const std::function<void(const Row& row)>& take) const;

  /// Deletes the file.
  void remove();

 private:
  void begin(const std::string& head);
  void check_head(const std::vector<std::string>& head) const;
  void read_rows();

  std::string path_;
  std::uint64_t runs_;
  int descriptor_;
  off_t begin_ = 0;  // of the rows, bytes
  off_t end_ = 0;
  FinishedRuns finished_;
  Tally tally_;
};

}  // namespace youbot_base_sim
