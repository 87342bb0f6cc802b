#include "youbot_base_sim/identify/report.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <map>

#include "youbot_base_sim/scene/yaml_file.h"

namespace youbot_base_sim {

namespace {

using Comments = std::map<std::string, std::string>;  // by section.key

std::string list_of(const Wheels& w) { return fmt::format("[{:.4f}]", fmt::join(w, ", ")); }

/// Puts what was fitted into the scene file.
void set_fitted(YAML::Node& root, const Fit& fit, Comments& comments) {
  const RobotParameters& robot = fit.best.scene.robot;
  for (const auto& [p, number, sigma, error_without] : fit.numbers) {
    std::string key = p->key;
    YAML::Node value(fmt::format("{:.6g}", number));
    if (key == "roller_angle" && robot.roller_angle.minCoeff() < 0) value = YAML::Load(list_of(robot.roller_angle));
    if (key == "com_X" || key == "com_Y") {
      key = "com";
      value = YAML::Load(fmt::format("[{:.6g}, {:.6g}]", robot.a_X, robot.a_Y));
    }
    if (key == "wheel_radius") root["robot"]["roller_axis_radius"] = fmt::format("{:.6g}", robot.R_d);
    root[p->section][key] = value;
    std::string& comment = comments[fmt::format("{}.{}", p->section, key)];
    if (key == "com") comment += fmt::format("{}{}: ", comment.empty() ? "" : ", ", p->key);
    comment += fmt::format("fitted, sigma {:.2g} {}", sigma, p->unit);
  }
}

/// The scene file from which a fit started, without its drive.
YAML::Node read_start(const std::string& path) {
  YAML::Node root(YAML::NodeType::Map);
  if (path.empty()) {
    root["robot"]["profile"] = "measured";
  } else {
    root = YAML::Clone(YAML::Load(read_yaml_text(path)));
  }
  for (const char* section : {"robot", "motors", "floor"}) {
    if (root[section]) root[section].SetStyle(YAML::EmitterStyle::Block);
  }
  root.SetStyle(YAML::EmitterStyle::Block);
  root.remove("drive");
  root.remove("initial");
  return root;
}

void set_initial_angles(YAML::Node& root, const Wheels& phi, Comments& comments) {
  root["initial"]["wheel_angles"] = YAML::Load(list_of(phi));
  comments["initial.wheel_angles"] = "fitted, but for whole rollers";
}

void emit(YAML::Emitter& out, const std::string& path, const YAML::Node& node, const Comments& comments) {
  if (!node.IsMap() || node.Style() == YAML::EmitterStyle::Flow) {
    out << node;
    return;
  }
  out << YAML::BeginMap;
  for (const auto& entry : node) {
    const auto key = entry.first.as<std::string>();
    const std::string full = path.empty() ? key : fmt::format("{}.{}", path, key);
    out << YAML::Key << key << YAML::Value;
    emit(out, full, entry.second, comments);
    if (const auto comment = comments.find(full); comment != comments.end()) out << YAML::Comment(comment->second);
  }
  out << YAML::EndMap;
}

std::string text_of(YAML::Node root, const DriveRecord& record, const Fit& fit, const Comments& comments) {
  root["duration"] = fmt::format("{:.3f}", record.duration());
  YAML::Emitter out;
  out << YAML::Comment(fmt::format("By identify, from {}. Error on what was held out {:.3g}, before the fit {:.3g}.",
                                   record.name, fit.error_after, fit.error_before))
      << YAML::Newline;
  emit(out, "", root, comments);
  return std::string(out.c_str()) + "\n";
}

/// A table of four wheels; `row` has places for time and wheels.
std::string table(const std::vector<double>& t, const std::vector<Wheels>& wheels, const char* row) {
  std::string text = "t,fl,fr,bl,br\n";
  for (std::size_t k = 0; k < t.size(); ++k) text += fmt::format(row, t[k], fmt::join(wheels[k], ","));
  return text;
}

/// What was fitted, and what was not.
std::string numbers(const Scene& start, const Fit& fit) {
  std::string text =
      fmt::format("{:<36} {:>10} {:>10} {:>10}  held-out error without it\n", "", "start", "fitted", "sigma");
  for (const auto& [p, value, sigma, error_without] : fit.numbers) {
    text += fmt::format("{:<36} {:>10.4g} {:>10.4g} {:>10.1g}  {:.4g} ({})\n", p->name(), p->get(start), value, sigma,
                        error_without, p->unit);
  }
  for (Eigen::Index a = 0; a < fit.correlation.rows(); ++a) {
    for (Eigen::Index b = 0; b < a; ++b) {
      const std::string one = fit.numbers[b].parameter->name(), other = fit.numbers[a].parameter->name();
      const bool replace_each_other = one == "robot.roller_dry_friction" && other == "robot.roller_angle";
      if (std::abs(fit.correlation(a, b)) < 0.8 && !replace_each_other) continue;
      text += fmt::format("correlated by {:.2f}: {} and {}\n", fit.correlation(a, b), one, other);
    }
  }
  for (const std::string& line : fit.unidentifiable) text += "not identified, start value kept: " + line + "\n";
  return text;
}

}  // namespace

std::string report(const Scene& start, const Fit& fit) {
  return numbers(start, fit) +
         fmt::format(
             "error on motions that were held out: {:.3g} before, {:.3g} after (in units of 0.02 rad/s, 0.02 "
             "N m, and 2 mm or 2 mrad in half a second)\n",
             fit.error_before, fit.error_after);
}

std::string report(const Scene& start, const std::vector<DriveRecord>& records, const EncoderFit& fit) {
  std::string text = numbers(start, fit);
  for (std::size_t r = 0; r < records.size(); ++r) {
    const EncoderFit::Drive& drive = fit.drives[r];
    text += fmt::format(
        "{}: ground truth has the instant t of the encoders at {:.5f} t {:+.4f} s (sigma {:.1g}, {:.1g} s)\n",
        records[r].name, 1 + drive.clock.stretch, drive.clock.offset, drive.sigma.stretch, drive.sigma.offset);
    if (drive.jumps > 0)
      text += fmt::format("{}: {} displacements where ground truth jumps are left out\n", records[r].name, drive.jumps);
    if (!drive.angles_at_zero) continue;
    text += fmt::format("{}: angles where the encoders read zero, but for whole rollers, rad: {} (sigma {})\n",
                        records[r].name, list_of(*drive.angles_at_zero), list_of(*drive.angles_sigma));
  }
  text += fmt::format(
      "error on stretches that were held out (1: the usual one): {:.3g} before, {:.3g} by fitted kinematics, {:.3g} "
      "where angles are unknown, {:.3g} after\nerror of a wheel's path, slip_odometry's ~wheel_error: {:.2g}\n",
      fit.error_before, fit.error_kinematics, fit.error_unknown, fit.error_after, fit.wheel_error);
  if (fit.error_unknown < fit.error_after) text += "wheel angles do not lower the error: fit with --unknown-angles\n";
  return text;
}

std::string fitted_scene(const std::string& start_path, const Fit& fit, const DriveRecord& record,
                         const std::string& table) {
  YAML::Node root = read_start(start_path);
  Comments comments;
  set_fitted(root, fit, comments);
  root["motors"]["quantized"] = true;
  set_initial_angles(root, fit.best.phi.front(), comments);
  root["drive"]["velocity_table"] = table;
  return text_of(root, record, fit, comments);
}

std::string fitted_scene(const std::string& start_path, const EncoderFit& fit, const DriveRecord& record,
                         const std::string& table) {
  YAML::Node root = read_start(start_path);
  Comments comments;
  set_fitted(root, fit, comments);
  root.remove("motors");
  if (root["solver"]) root["solver"].remove("control_period");  // a table of angles takes none
  if (const auto& angles = fit.drives.front().angles_at_zero)
    set_initial_angles(root, *angles + record.phi.front(), comments);
  root["drive"]["wheel_angle_table"] = table;
  if (fit.resolution > 0) root["drive"]["resolution"] = fmt::format("{:.6g}", fit.resolution);
  return text_of(root, record, fit, comments);
}

std::string angle_table(const DriveRecord& record) { return table(record.t, record.phi, "{:.6f},{:.9g}\n"); }

std::string command_table(const DriveRecord& record) {
  return table(record.commands.t, record.commands.values, "{:.6f},{:.7g}\n");
}

std::string comparison_csv(const Fit& fit, const DriveRecord& record) {
  const Prediction fitted = predict(fit.best.scene, record, fit.best.phi.front());
  std::vector<std::vector<Eigen::Vector3d>> series;
  std::string text = "t,held_out";
  const std::pair<const char*, const std::vector<Wheels>*> columns[] = {{"rate", &record.dphi},
                                                                        {"torque", &record.torque},
                                                                        {"fitted_rate", &fitted.dphi},
                                                                        {"fitted_torque", &fitted.torque}};
  for (const auto& [name, wheels] : columns) {
    for (const char* mode : kModeNames) text += fmt::format(",{}_{}", name, mode);
    std::vector<Eigen::Vector3d> samples = modes_of(*wheels);
    samples.resize(record.t.size(), Eigen::Vector3d::Zero());
    series.push_back(low_pass(record.t, samples, kComparisonFilter));
  }
  text += "\n";
  const std::vector<Motion> motions = record.motions();
  for (std::size_t k = 0; k < record.t.size(); ++k) {
    const Motion& motion = motion_at(motions, record.t[k]);
    text += fmt::format("{:.4f},{}", record.t[k], record.t[k] < motion.end && motion.held_out ? 1 : 0);
    for (const auto& samples : series) {
      for (int m = 0; m < kModes; ++m) text += fmt::format(",{:.6g}", samples[k][m]);
    }
    text += "\n";
  }
  return text;
}

}  // namespace youbot_base_sim
