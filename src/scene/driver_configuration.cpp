#include "youbot_base_sim/scene/driver_configuration.h"

#include <fmt/format.h>

#include <boost/property_tree/ini_parser.hpp>
#include <filesystem>
#include <sstream>

#include "youbot_base_sim/scene/scene_value.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/text_file.h"

namespace youbot_base_sim {

namespace {

constexpr std::size_t kMaxBytes = 1'000'000;

constexpr Range kRadius{1e-3, 1, "m"};
constexpr Range kLength{1e-3, 100, "m"};
constexpr Range kTeeth{1, 1e6, ""};
constexpr Range kGearRatio{1e-3, 10, ""};
constexpr Range kTicks{1, 1e9, ""};
constexpr Range kTorqueConstant{1e-4, 10, "N m/A"};

/// The sections of a file and their keys.
YAML::Node read_sections(const std::string& path) {
  const std::string file = quote_path(path);
  boost::property_tree::ptree tree;
  try {
    std::istringstream text(read_text_file(path, kMaxBytes));
    boost::property_tree::read_ini(text, tree);
  } catch (const UnreadableFile& error) {
    throw SceneError(fmt::format("{}: {}; must be a configuration file", file, error.what()));
  } catch (const boost::property_tree::ini_parser_error& error) {
    throw SceneError(fmt::format("{}, line {}: {}", file, error.line(), quote(error.message(), kMaxMessage)));
  }
  YAML::Node sections(YAML::NodeType::Map);
  for (const auto& [name, keys] : tree) {
    YAML::Node section(YAML::NodeType::Map);
    for (const auto& [key, value] : keys) section.force_insert(key, value.data());
    sections.force_insert(name, section);
  }
  return sections;
}

/// Refuses any value of the key but `only`, the one that the simulation implements.
void expect(SceneValue& section, const std::string& key, const std::string& only) {
  std::string text;
  section.required(key).choice(text, {only});
}

DriverKinematics read_kinematics(SceneValue s) {
  DriverKinematics kinematics;
  double wheelbase = 0, track = 0;
  s.required("WheelRadius_[meter]").number(kinematics.wheel_radius, kRadius);
  s.required("LengthBetweenFrontAndRearWheels_[meter]").number(wheelbase, kLength);
  s.required("LengthBetweenFrontWheels_[meter]").number(track, kLength);
  expect(s, "RotationRatio", "1");
  expect(s, "SlideRatio", "1");
  s.require_all();
  kinematics.half_lengths = (wheelbase + track) / 2;
  return kinematics;
}

Motor read_motor(SceneValue s) {
  Motor motor;
  double numerator = 1, denominator = 1;
  const SceneValue gear = s.required("GearRatio_numerator").number(numerator, kTeeth);
  s.required("GearRatio_denominator").number(denominator, kTeeth);
  s.required("EncoderTicksPerRound").number(motor.encoder_ticks, kTicks);
  s.required("TorqueConstant_[newton_meter_divided_by_ampere]").number(motor.torque_constant, kTorqueConstant);
  expect(s, "InverseMovementDirection", "false");
  s.require_all();
  motor.gear_ratio = numerator / denominator;
  if (!contains(kGearRatio, motor.gear_ratio)) {
    gear.refuse("such that the ratio of the gear is " + text_of(kGearRatio));
  }
  return motor;
}

bool equal(const Motor& a, const Motor& b) {
  return a.gear_ratio == b.gear_ratio && a.encoder_ticks == b.encoder_ticks && a.torque_constant == b.torque_constant;
}

}  // namespace

DriverConfiguration load_driver_configuration(const std::string& folder, const std::string& name) {
  const std::string path = std::filesystem::path(folder) / (name + ".cfg");
  SceneValue file(quote_path(path), "", read_sections(path), "configuration");
  DriverConfiguration configuration{read_motor(file["Joint_1"]), read_kinematics(file["YouBotKinematic"])};
  for (int i = 1; i < kWheels; ++i) {
    const std::string section = fmt::format("Joint_{}", i + 1);
    const SceneValue joint = file[section];
    if (!equal(read_motor(joint), configuration.motor)) joint.refuse_for("motor and gear must be those of Joint_1");
  }
  return configuration;
}

}  // namespace youbot_base_sim
