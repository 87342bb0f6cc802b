#include "wheel_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/text_file.h"

namespace youbot_base_sim {

namespace {

constexpr std::size_t kMaxBytes = 250'000'000;  // an hour at 1 kHz with all figures of a double
constexpr std::size_t kColumns = 5;
constexpr std::array<const char*, kColumns> kNames = {"t", "fl", "fr", "bl", "br"};

/// Takes the text before the separator, and the separator, off the front of `text`; all if there is none.
std::string_view take(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view before = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return before;
}

std::string_view take_line(std::string_view& text) {
  std::string_view line = take(text, '\n');
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string_view take_cell(std::string_view& line) {
  constexpr char kAround[] = " \t\"";
  std::string_view cell = take(line, ',');
  cell.remove_prefix(std::min(cell.find_first_not_of(kAround), cell.size()));
  cell.remove_suffix(cell.size() - (cell.find_last_not_of(kAround) + 1));
  return cell;
}

std::size_t count_cells(std::string_view line) {
  return 1 + static_cast<std::size_t>(std::count(line.begin(), line.end(), ','));
}

/// The columns of t, fl, fr, bl and br, in this order. The header is not quoted: the file `name` may be private.
std::array<std::size_t, kColumns> columns_of(const std::string& name, std::string_view header) {
  const auto refuse = [&](const std::string& what) {
    throw SceneError(fmt::format("{}:1: header: {}; must be {}, each once, between commas", name, what, kTableColumns));
  };
  std::vector<std::string_view> cells(count_cells(header));
  for (std::string_view& cell : cells) cell = take_cell(header);
  std::array<std::size_t, kColumns> columns;
  for (std::size_t k = 0; k < kColumns; ++k) {
    const auto found = std::find(cells.begin(), cells.end(), kNames[k]);
    if (found == cells.end()) refuse(fmt::format("no column {}", kNames[k]));
    if (std::find(found + 1, cells.end(), kNames[k]) != cells.end()) refuse(fmt::format("column {} twice", kNames[k]));
    columns[k] = static_cast<std::size_t>(found - cells.begin());
  }
  if (cells.size() != kColumns) refuse(fmt::format("{} columns", cells.size()));
  return columns;
}

}  // namespace

WheelTable read_wheel_table(const std::string& path, const Range& time, const Range& values) {
  const std::string text = read_text_file(path, kMaxBytes), name = quote_path(path);
  std::string_view lines = text;
  const std::array<std::size_t, kColumns> columns = columns_of(name, take_line(lines));

  WheelTable table;
  for (int number = 2; !lines.empty(); ++number) {
    std::string_view line = take_line(lines);
    if (line.find_first_not_of(" \t") == std::string_view::npos) continue;
    const auto refuse = [&](const std::string& what) {
      throw SceneError(fmt::format("{}:{}: {}", name, number, what));
    };
    if (count_cells(line) != kColumns) refuse(fmt::format("{}: must be {} numbers", quote(line), kColumns));
    std::array<std::string_view, kColumns> cells;
    for (std::string_view& cell : cells) cell = take_cell(line);
    std::array<double, kColumns> row;
    for (std::size_t k = 0; k < kColumns; ++k) {
      const std::string_view cell = cells[columns[k]];
      const Range& range = k == 0 ? time : values;
      if (read_number(cell, row[k]) && contains(range, row[k])) continue;
      refuse(fmt::format("{} = {}: must be {}", kNames[k], quote(cell), text_of(range)));
    }
    if (!table.t.empty() && row[0] <= table.t.back()) {
      refuse(fmt::format("t = {}: must be greater than the row's before, {}", row[0], table.t.back()));
    }
    table.t.push_back(row[0]);
    table.values.emplace_back(row[1], row[2], row[3], row[4]);
  }
  if (table.t.empty()) throw SceneError(fmt::format("{}: no rows; must have at least one", name));
  return table;
}

}  // namespace youbot_base_sim
