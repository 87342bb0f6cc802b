#include "youbot_base_sim/drive/driver_configuration.h"

#include <fmt/format.h>

#include <boost/property_tree/ini_parser.hpp>
#include <cmath>
#include <filesystem>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

namespace {

/// Reads values from one file and names the file in errors.
class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {
    try {
      boost::property_tree::read_ini(path, tree_);
    } catch (const boost::property_tree::ini_parser_error& error) {
      throw DriverConfigurationError(error.line() == 0
                                         ? fmt::format("{}: {}", path, error.message())
                                         : fmt::format("{}, line {}: {}", path, error.line(), error.message()));
    }
  }

  double positive(const std::string& section, const std::string& key) const {
    const std::string text = value(section, key);
    char* end = nullptr;
    const double number = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !(number > 0) || !std::isfinite(number)) {
      throw refusal(section, key, text, "a number > 0");
    }
    return number;
  }

  /// Refuses any value but `only`, the one that the simulation implements.
  void expect(const std::string& section, const std::string& key, const std::string& only) const {
    const std::string text = value(section, key);
    if (text != only) throw refusal(section, key, text, only);
  }

  DriverConfigurationError refusal(const std::string& section, const std::string& key, const std::string& text,
                                   const std::string& allowed) const {
    return DriverConfigurationError(fmt::format("{}: [{}] {} = {}: must be {}", path_, section, key, text, allowed));
  }

 private:
  std::string value(const std::string& section, const std::string& key) const {
    // Property trees split a path at dots, which may be part of a key; '/' is not.
    const auto found =
        tree_.get_optional<std::string>(boost::property_tree::ptree::path_type(section + "/" + key, '/'));
    if (!found) throw DriverConfigurationError(fmt::format("{}: [{}] {} is missing", path_, section, key));
    return *found;
  }

  std::string path_;
  boost::property_tree::ptree tree_;
};

Motor read_motor(const Reader& reader, const std::string& section) {
  Motor motor;
  motor.gear_ratio =
      reader.positive(section, "GearRatio_numerator") / reader.positive(section, "GearRatio_denominator");
  motor.encoder_ticks = reader.positive(section, "EncoderTicksPerRound");
  motor.torque_constant = reader.positive(section, "TorqueConstant_[newton_meter_divided_by_ampere]");
  reader.expect(section, "InverseMovementDirection", "false");
  return motor;
}

bool equal(const Motor& a, const Motor& b) {
  return a.gear_ratio == b.gear_ratio && a.encoder_ticks == b.encoder_ticks && a.torque_constant == b.torque_constant;
}

}  // namespace

DriverConfiguration load_driver_configuration(const std::string& folder, const std::string& name) {
  constexpr char kKinematics[] = "YouBotKinematic";
  const std::string path = std::filesystem::path(folder) / (name + ".cfg");
  const Reader reader(path);
  DriverConfiguration configuration;
  configuration.kinematics.wheel_radius = reader.positive(kKinematics, "WheelRadius_[meter]");
  configuration.kinematics.half_lengths = (reader.positive(kKinematics, "LengthBetweenFrontAndRearWheels_[meter]") +
                                           reader.positive(kKinematics, "LengthBetweenFrontWheels_[meter]")) /
                                          2;
  reader.expect(kKinematics, "RotationRatio", "1");
  reader.expect(kKinematics, "SlideRatio", "1");
  configuration.motor = read_motor(reader, "Joint_1");
  for (int i = 1; i < kWheels; ++i) {
    const std::string section = fmt::format("Joint_{}", i + 1);
    if (equal(read_motor(reader, section), configuration.motor)) continue;
    throw DriverConfigurationError(fmt::format("{}: [{}]: motor and gear must be those of [Joint_1]", path, section));
  }
  return configuration;
}

}  // namespace youbot_base_sim
