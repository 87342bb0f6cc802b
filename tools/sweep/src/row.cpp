#include "youbot_base_sim/sweep/row.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <boost/tokenizer.hpp>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "youbot_base_sim/sweep/finished_table.h"

namespace youbot_base_sim {

namespace {

constexpr char kTrajectory[] = "run_";  // what the name of each begins with

const char* text_of(RunStatus status) {
  if (status == RunStatus::kRefused) return "refused";
  return status == RunStatus::kFailed ? "failed" : "done";
}

/// A cell of CSV (RFC 4180).
std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  return '"' + boost::algorithm::replace_all_copy(text, "\"", "\"\"") + '"';
}

}  // namespace

RowMaker::RowMaker(const Family& family, std::string folder, MakeRecorder make_bag)
    : family_(family), folder_(std::move(folder)), make_bag_(std::move(make_bag)) {}

std::string RowMaker::header() const {
  std::string header = "run";
  for (const Axis& axis : family_.axes) header += "," + axis.key;
  header += ",status,reliable";
  for (const Quantity& quantity : family_.quantities) header += fmt::format(",{}", quantity.name);
  return header + ",reason";
}

std::string RowMaker::axis_cells(std::uint64_t run) const {
  std::string cells;
  for (const SceneSetting& setting : family_.settings(run)) cells += "," + cell(setting.value);
  return cells;
}

Row RowMaker::make(std::uint64_t run, const std::atomic<bool>& stop) const {
  if (finished_ && !keeps_trajectory(run)) {
    if (const auto row = finished_->row(run)) return *row;
  }
  const SceneSettings settings = family_.settings(run);
  Row row{run, RunStatus::kDone, ""};
  std::string values(family_.quantities.size(), ','), reason;
  try {
    const Scene scene = load_scene(family_.scene, settings, SceneUse::kRun, keeps_trajectory(run));
    require_drive(scene);
    values = simulate(scene, open_trajectory(run), stop, reason);
    if (!reason.empty()) row.status = RunStatus::kDoubtful;
  } catch (const Stopped&) {
    throw;
  } catch (const OutputError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const SceneError& error) {
    row.status = RunStatus::kRefused;
    reason = error.what();
  } catch (const std::exception& error) {
    row.status = RunStatus::kFailed;
    reason = error.what();
  }
  row.text = fmt::format("{}{},{},{}{},{}", run, axis_cells(run), text_of(row.status), row.status == RunStatus::kDone,
                         values, cell(reason));
  return row;
}

/// The quantities at the end of a scene, each after a comma, and why they may be unreliable.
std::string RowMaker::simulate(const Scene& scene, const std::unique_ptr<Recorder>& trajectory,
                               const std::atomic<bool>& stop, std::string& reason) const {
  Simulation simulation(scene);
  simulation.stop_on(stop);
  ObservedRun run(simulation);
  while (run.next()) {
    const Events events = simulation.take_events();
    if (trajectory) trajectory->write(run.rows().t(), simulation, events);
  }
  if (trajectory) trajectory->commit();
  reason = unreliability_reason(simulation, run.rows(), nullptr);
  std::string values;
  for (const Quantity& quantity : family_.quantities) values += fmt::format(",{}", quantity.value(run));
  return values;
}

void RowMaker::keep_trajectories(OutputOpener& opener) const {
  if (!family_.trajectories) return;
  opener.keep_all("trajectories", folder_, [&](const std::string& name) {
    std::uint64_t run = 0;
    if (name.rfind(kTrajectory, 0) != 0) return false;
    const auto [end, error] = std::from_chars(name.data() + std::strlen(kTrajectory), name.data() + name.size(), run);
    return error == std::errc() && run < family_.runs() && keeps_trajectory(run) && name == trajectory_name(run);
  });
}

bool RowMaker::keeps_trajectory(std::uint64_t run) const {
  return family_.trajectories && run % static_cast<std::uint64_t>(family_.trajectories->every) == 0;
}

std::string RowMaker::trajectory_name(std::uint64_t run) const {
  const auto digits = fmt::format("{}", family_.runs() - 1).size();
  return fmt::format("{}{:0{}}.{}", kTrajectory, run, digits, family_.trajectories->format);
}

std::unique_ptr<Recorder> RowMaker::open_trajectory(std::uint64_t run) const {
  if (!keeps_trajectory(run)) return nullptr;
  std::error_code error;
  std::filesystem::create_directory(folder_, error);
  if (error) refuse_output(folder_, error.value());
  const bool is_csv = family_.trajectories->format == "csv";
  OutputFile file(fmt::format("{}/{}", folder_, trajectory_name(run)),
                  is_csv ? OutputFile::Access::kInOrder : OutputFile::Access::kAnywhere);
  file.sync_on_commit();  // as its row is
  if (is_csv) return state_csv(std::move(file));
  return make_bag_(std::move(file));
}

Spread::Spread(const Family& family) {
  const std::size_t first = 3 + family.axes.size();  // after run, axes, status and reliable
  for (std::size_t k = 0; k < family.quantities.size(); ++k) columns_.push_back({family.quantities[k].name, first + k});
}

void Spread::add(const Row& row) {
  if (row.status != RunStatus::kDone && row.status != RunStatus::kDoubtful) return;
  using Separator = boost::escaped_list_separator<char>;
  const boost::tokenizer<Separator> split(row.text, Separator("", ",", "\""));  // no escapes but doubled quotes
  const std::vector<std::string> cells(split.begin(), split.end());
  ++count_;
  for (Column& column : columns_) {
    const double value = std::strtod(cells[column.index].c_str(), nullptr);  // stod refuses subnormal numbers
    column.min = count_ == 1 ? value : std::min(column.min, value);
    column.max = count_ == 1 ? value : std::max(column.max, value);
    const double off = value - column.mean;
    column.mean += off / static_cast<double>(count_);
    column.squares += off * (value - column.mean);
  }
}

std::string Spread::text() const {
  if (count_ == 0) return "";
  std::string text = fmt::format("{:<24}{:>13}{:>13}{:>13}{:>13}{:>13}\n", "(units: --help)", "minimum", "maximum",
                                 "spread", "mean", "deviation");
  const auto known = [](double value) { return std::abs(value) < 1e-9 ? 0 : value; };  // no run is exact beyond
  const double degrees_of_freedom = std::max(1.0, static_cast<double>(count_ - 1));
  for (const Column& c : columns_)
    text += fmt::format("{:<24}{:>13.6g}{:>13.6g}{:>13.6g}{:>13.6g}{:>13.3g}\n", c.name, known(c.min), known(c.max),
                        known(c.max - c.min), known(c.mean), known(std::sqrt(c.squares / degrees_of_freedom)));
  return text;
}

}  // namespace youbot_base_sim
