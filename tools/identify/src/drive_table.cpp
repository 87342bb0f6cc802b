#include "youbot_base_sim/identify/drive_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/split.hpp>
#include <boost/algorithm/string/trim.hpp>
#include <optional>
#include <sstream>

#include "youbot_base_sim/text/number.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/text_file.h"

namespace youbot_base_sim {

namespace {

constexpr std::size_t kMaxBytes = 1'000'000'000;
constexpr Range kAny{-1e9, 1e9, ""};

using Cells = std::vector<std::string>;

/// Columns whose cells a row has all or none of.
template <int kSize>
class Group {
 public:
  using Values = Eigen::Array<double, kSize, 1>;

  /// Throws UnusableRecord where the header has some of the names.
  Group(const Cells& header, const std::array<std::string, kSize>& names, const std::string& where) : names_(names) {
    for (const std::string& name : names) {
      const auto found = std::find(header.begin(), header.end(), name);
      if (found != header.end()) places_.push_back(static_cast<std::size_t>(found - header.begin()));
    }
    if (!places_.empty() && places_.size() < kSize)
      throw UnusableRecord(fmt::format("{}: header: must have {} or none of them", where, fmt::join(names, ", ")));
  }

  bool there() const { return !places_.empty(); }

  /// Nothing of empty cells. Throws UnusableRecord.
  std::optional<Values> of(const Cells& cells, const std::string& where) const {
    const auto is_empty = [&](std::size_t place) { return cells[place].empty(); };
    if (std::all_of(places_.begin(), places_.end(), is_empty)) return {};
    Values values;
    for (std::size_t k = 0; k < kSize; ++k) {
      double& value = values[static_cast<Eigen::Index>(k)];
      const std::string& cell = cells[places_[k]];
      if (!read_number(cell, value) || !contains(kAny, value))
        throw UnusableRecord(fmt::format("{}: {} = {}: must be {}", where, names_[k], quote(cell), text_of(kAny)));
    }
    return values;
  }

 private:
  std::array<std::string, kSize> names_;
  std::vector<std::size_t> places_;
};

std::array<std::string, kWheels> of_wheels(const std::string& quantity) {
  std::array<std::string, kWheels> names;
  for (int i = 0; i < kWheels; ++i) names[static_cast<std::size_t>(i)] = fmt::format("{}_{}", quantity, kWheelNames[i]);
  return names;
}

Cells cells_of(std::string line) {
  Cells cells;
  boost::split(cells, line, boost::is_any_of(","));
  for (std::string& cell : cells) boost::trim(cell);
  return cells;
}

std::string text_of(const std::string& path, const std::string& name) {
  try {
    return read_text_file(path, kMaxBytes);
  } catch (const UnreadableFile& error) {
    throw UnusableRecord(fmt::format("{} {}; must be a table", name, error.what()));
  }
}

/// Throws UnusableRecord unless it is later than those before.
void add_time(std::vector<double>& t, double time, const std::string& where) {
  if (!t.empty() && time <= t.back())
    throw UnusableRecord(fmt::format("{}: t = {}: must be greater than the row's before, {}", where, time, t.back()));
  t.push_back(time);
}

void differentiate_angles(DriveRecord& record) {
  record.rates_from_angles = true;
  const std::size_t last = record.t.size() - 1;
  for (std::size_t k = 0; k <= last; ++k) {
    const std::size_t a = k > 0 ? k - 1 : 0, b = std::min(k + 1, last);
    record.dphi.push_back(a < b ? Wheels((record.phi[b] - record.phi[a]) / (record.t[b] - record.t[a]))
                                : Wheels(Wheels::Zero()));
  }
}

}  // namespace

DriveRecord read_drive_table(const std::string& path, const std::string& name) {
  std::istringstream lines(text_of(path, name));
  std::string line;
  std::getline(lines, line);
  const Cells header = cells_of(line);
  const Group<1> time(header, {"t"}, name);
  const Group<kWheels> phi(header, of_wheels("phi"), name), dphi(header, of_wheels("dphi"), name),
      torque(header, of_wheels("torque"), name), command(header, of_wheels("command"), name);
  const Group<3> pose(header, {"x", "y", "psi"}, name);
  if (!time.there() || !phi.there()) throw UnusableRecord(name + ": header: must have t and phi_fl to phi_br");

  DriveRecord record;
  record.name = name;
  for (int number = 2; std::getline(lines, line); ++number) {
    const std::string where = fmt::format("{}:{}", name, number);
    const Cells cells = cells_of(line);
    if (cells.size() != header.size())
      throw UnusableRecord(fmt::format("{}: {} cells; must be {}", where, cells.size(), header.size()));
    const auto t = time.of(cells, where);
    if (!t) throw UnusableRecord(where + ": must have t");
    const auto angles = phi.of(cells, where), rates = dphi.of(cells, where), torques = torque.of(cells, where);
    if ((dphi.there() && rates.has_value() != angles.has_value()) ||
        (torque.there() && torques.has_value() != angles.has_value()))
      throw UnusableRecord(where + ": must have all of phi, dphi and torque, or none");
    if (angles) {
      add_time(record.t, (*t)[0], where);
      record.phi.push_back(*angles);
    }
    if (rates) record.dphi.push_back(*rates);
    if (torques) record.torque.push_back(*torques);
    if (const auto rate = command.of(cells, where)) {
      add_time(record.commands.t, (*t)[0], where);
      record.commands.values.push_back(*rate);
    }
    if (const auto at = pose.of(cells, where)) {
      add_time(record.truth_t, (*t)[0], where);
      record.truth.emplace_back(at->matrix());
    }
  }
  if (record.t.empty()) throw UnusableRecord(name + ": no rows with angles of the wheels");
  if (!dphi.there()) differentiate_angles(record);
  record.max_truth_step = 5 * usual_interval(record.truth_t) + 1e-9;
  const double start = record.t.front();
  for (std::vector<double>* times : {&record.t, &record.commands.t, &record.truth_t}) {
    for (double& t : *times) t -= start;
  }
  return record;
}

}  // namespace youbot_base_sim
