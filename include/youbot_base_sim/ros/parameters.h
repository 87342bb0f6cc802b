#pragma once

#include <ros/node_handle.h>

#include <functional>
#include <set>
#include <stdexcept>
#include <string>

namespace youbot_base_sim {

/// A parameter is wrong. The text is one line with its name, its value and what is allowed.
class ParameterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads the parameters of a node, once at its start. Each getter throws ParameterError for a value of the wrong type.
class Parameters {
 public:
  /// Parameters in the namespace of `node`. Errors write `prefix` before the name: "~" for private ones.
  Parameters(const ros::NodeHandle& node, const std::string& prefix) : node_(node), prefix_(prefix) {}

  std::string text(const std::string& name, const std::string& default_value);
  bool flag(const std::string& name, bool default_value);
  /// Refuses a value outside [min, max]; `unit` is for the error's text.
  double number(const std::string& name, double default_value, double min, double max, const char* unit);
  /// The same, but 0 is allowed too.
  double zero_or_number(const std::string& name, double default_value, double min, double max, const char* unit);

  /// The refusal of `value` for a parameter: "parameter ~name = value: must be ...".
  ParameterError refusal(const std::string& name, const std::string& value, const std::string& allowed) const;

  /// Throws if a parameter is set that no getter has asked for: it is probably misspelt.
  void refuse_others() const;

 private:
  bool get(const std::string& name, XmlRpc::XmlRpcValue& value);
  double number(const std::string& name, double default_value, const std::function<bool(double)>& is_allowed,
                const std::string& allowed);

  ros::NodeHandle node_;
  std::string prefix_;
  std::set<std::string> known_;
};

}  // namespace youbot_base_sim
