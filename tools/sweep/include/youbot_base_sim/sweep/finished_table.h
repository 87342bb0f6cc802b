#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/sweep/family.h"
#include "youbot_base_sim/sweep/row.h"

namespace youbot_base_sim {

/// Rows of a finished table of the same axes for a family with more draws or more points of the grid. Thread-safe.
class FinishedTable {
 public:
  /// Finds the run of each row. Throws SceneError for a table that has another row, which it names, or other columns;
  /// and if one of a few rows comes out otherwise when `maker` makes it again: the table has another scene or build.
  FinishedTable(const std::string& path, const Family& family, const RowMaker& maker);

  /// The row of a run, if the table has it. Throws OutputError if it cannot be read.
  std::optional<Row> row(std::uint64_t run) const;

 private:
  /// The place of a run's row, without its number.
  struct Line {
    std::uint64_t run;
    RunStatus status;
    off_t begin;
    std::size_t size;
  };

  void find_rows(const Family& family, const RowMaker& maker);
  void compare_rows(const RowMaker& maker) const;
  std::string text(const Line& line) const;

  std::string path_;
  Descriptor descriptor_;
  std::vector<Line> lines_;  // in the order of runs
};

}  // namespace youbot_base_sim
