#include "youbot_base_sim/drive/driver_configuration.h"

#include <fmt/format.h>

#include <boost/property_tree/ini_parser.hpp>
#include <filesystem>
#include <sstream>

#include "youbot_base_sim/physics/state.h"
#include "youbot_base_sim/text/number.h"
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

/// Reads values from one file and names the file in errors.
class Reader {
 public:
  explicit Reader(const std::string& path) : file_(quote_path(path)) {
    try {
      std::istringstream text(read_text_file(path, kMaxBytes));
      boost::property_tree::read_ini(text, tree_);
    } catch (const UnreadableFile& error) {
      throw DriverConfigurationError(fmt::format("{}: {}; must be a configuration file", file_, error.what()));
    } catch (const boost::property_tree::ini_parser_error& error) {
      throw DriverConfigurationError(
          fmt::format("{}, line {}: {}", file_, error.line(), quote(error.message(), kMaxMessage)));
    }
  }

  double number(const std::string& section, const std::string& key, const Range& range) const {
    const std::string text = value(section, key);
    double number = 0;
    if (!read_number(text, number) || !contains(range, number)) refuse(section, key, text, text_of(range));
    return number;
  }

  /// Refuses any value but `only`, the one that the simulation implements.
  void expect(const std::string& section, const std::string& key, const std::string& only) const {
    const std::string text = value(section, key);
    if (text != only) refuse(section, key, text, only);
  }

  [[noreturn]] void refuse(const std::string& section, const std::string& key, const std::string& text,
                           const std::string& allowed) const {
    throw DriverConfigurationError(
        fmt::format("{}: [{}] {} = {}: must be {}", file_, section, key, quote(text), allowed));
  }

 private:
  std::string value(const std::string& section, const std::string& key) const {
    // Property trees split a path at dots, which may be part of a key; '/' is not.
    const auto found =
        tree_.get_optional<std::string>(boost::property_tree::ptree::path_type(section + "/" + key, '/'));
    if (!found) throw DriverConfigurationError(fmt::format("{}: [{}] {} is missing", file_, section, key));
    return *found;
  }

  std::string file_;  // its name as messages show it
  boost::property_tree::ptree tree_;
};

Motor read_motor(const Reader& reader, const std::string& section) {
  constexpr char kNumerator[] = "GearRatio_numerator";
  const double numerator = reader.number(section, kNumerator, kTeeth);
  Motor motor;
  motor.gear_ratio = numerator / reader.number(section, "GearRatio_denominator", kTeeth);
  if (!contains(kGearRatio, motor.gear_ratio)) {
    reader.refuse(section, kNumerator, fmt::format("{:g}", numerator),
                  "such that the ratio of the gear is " + text_of(kGearRatio));
  }
  motor.encoder_ticks = reader.number(section, "EncoderTicksPerRound", kTicks);
  motor.torque_constant = reader.number(section, "TorqueConstant_[newton_meter_divided_by_ampere]", kTorqueConstant);
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
  configuration.kinematics.wheel_radius = reader.number(kKinematics, "WheelRadius_[meter]", kRadius);
  configuration.kinematics.half_lengths =
      (reader.number(kKinematics, "LengthBetweenFrontAndRearWheels_[meter]", kLength) +
       reader.number(kKinematics, "LengthBetweenFrontWheels_[meter]", kLength)) /
      2;
  reader.expect(kKinematics, "RotationRatio", "1");
  reader.expect(kKinematics, "SlideRatio", "1");
  configuration.motor = read_motor(reader, "Joint_1");
  for (int i = 1; i < kWheels; ++i) {
    const std::string section = fmt::format("Joint_{}", i + 1);
    if (equal(read_motor(reader, section), configuration.motor)) continue;
    throw DriverConfigurationError(
        fmt::format("{}: [{}]: motor and gear must be those of [Joint_1]", quote_path(path), section));
  }
  return configuration;
}

}  // namespace youbot_base_sim
