#include "youbot_base_sim/sweep/finished_table.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <sstream>

#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

constexpr std::size_t kCompared = 4;  // rows that are made again, and the last

/// The first cell in which two rows differ, from 0; cells with commas count as several.
std::size_t first_difference(const std::string& a, const std::string& b) {
  const auto differing = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  return static_cast<std::size_t>(std::count(a.begin(), differing, ','));
}

/// A cell of a row without commas in cells.
std::string cell_of(const std::string& row, std::size_t index) {
  std::istringstream stream(row);
  std::string cell;
  for (std::size_t k = 0; k <= index; ++k) {
    if (!std::getline(stream, cell, ',')) return "";
  }
  return cell;
}

/// "name = a: must be b" of the first cell in which rows differ.
std::string difference(const std::string& header, const std::string& found, const std::string& expected) {
  const std::size_t k = first_difference(found, expected);
  return fmt::format("{} = {}: must be {}", quote(cell_of(header, k)), quote(cell_of(found, k)),
                     quote(cell_of(expected, k)));
}

RunStatus status_of(const std::string& cells) {
  if (cells.rfind(",refused,", 0) == 0) return RunStatus::kRefused;
  if (cells.rfind(",failed,", 0) == 0) return RunStatus::kFailed;
  return cells.rfind(",done,true,", 0) == 0 ? RunStatus::kDone : RunStatus::kDoubtful;
}

}  // namespace

FinishedTable::FinishedTable(const std::string& path, const Family& family, const RowMaker& maker)
    : path_(path), descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (descriptor_ < 0) {
    throw SceneError(fmt::format("{}: cannot be read: {}", quote_path(path_), OutputFile::text_of(errno)));
  }
  find_rows(family, maker);
  compare_rows(maker);
}

void FinishedTable::find_rows(const Family& family, const RowMaker& maker) {
  const auto refuse = [&](const std::string& what) {
    throw SceneError(fmt::format("{}: {}", quote_path(path_), what));
  };
  if (family.has_draws() && family.sampling == Sampling::kLatinHypercube) {
    refuse(quote_path(family.path) +
           ": sampling = latin_hypercube: must be independent or sobol, for draws that more "
           "draws leave as they are");
  }
  std::ifstream file(path_, std::ios::binary);
  const std::string header = maker.header();
  std::string line;
  std::getline(file, line);
  if (line != header) {
    refuse(fmt::format("column {}: must be {}, as of this family", quote(cell_of(line, first_difference(line, header))),
                       quote(cell_of(header, first_difference(line, header)))));
  }
  auto begin = static_cast<off_t>(line.size() + 1);
  std::uint64_t run = 0, number = 0;
  for (; std::getline(file, line); ++number, begin += static_cast<off_t>(line.size() + 1)) {
    const std::size_t comma = std::min(line.find(','), line.size());
    std::string cells;
    const auto is_next = [&] {
      cells = maker.axis_cells(run);
      return line.compare(comma, cells.size(), cells) == 0 && line[comma + cells.size()] == ',';
    };
    while (run < family.runs() && !is_next()) ++run;
    if (run == family.runs() || file.eof()) {
      const std::string expected = fmt::format("{}{}", number, maker.axis_cells(std::min(number, family.runs() - 1)));
      refuse(fmt::format("row {}: must be a run of this family after that of the row before: {}", number,
                         file.eof() ? "is torn" : difference(header, line, expected)));
    }
    const RunStatus status = status_of(line.substr(comma + cells.size()));
    lines_.push_back({run++, status, begin + static_cast<off_t>(comma), line.size() - comma});
  }
}

std::string FinishedTable::text(const Line& line) const {
  std::string text(line.size, '\0');
  if (pread(descriptor_, text.data(), text.size(), line.begin) != static_cast<ssize_t>(text.size())) {
    throw OutputError(fmt::format("{}: cannot be read: was changed meanwhile", quote_path(path_)));
  }
  return fmt::format("{}{}", line.run, text);
}

void FinishedTable::compare_rows(const RowMaker& maker) const {
  const std::atomic<bool> never{false};
  for (std::size_t k = 0; k <= kCompared && !lines_.empty(); ++k) {
    const Line& line = lines_[k * (lines_.size() - 1) / kCompared];
    const std::string found = text(line), made = maker.make(line.run, never).text;
    if (found == made) continue;
    throw SceneError(fmt::format("{}: run {}: {} by this scene, its tables and this build", quote_path(path_), line.run,
                                 difference(maker.header(), found, made)));
  }
}

std::optional<Row> FinishedTable::row(std::uint64_t run) const {
  const auto line =
      std::lower_bound(lines_.begin(), lines_.end(), run, [](const Line& a, std::uint64_t b) { return a.run < b; });
  if (line == lines_.end() || line->run != run) return std::nullopt;
  return Row{run, line->status, text(*line)};
}

}  // namespace youbot_base_sim
