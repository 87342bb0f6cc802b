#pragma once

#include <ros/node_handle.h>

#include <optional>
#include <set>
#include <stdexcept>
#include <string>

#include "youbot_base_sim/text/number.h"

namespace youbot_base_sim {

/// A parameter is wrong. The text is one line with its name, its value and what is allowed.
class ParameterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads the parameters of a node, once at its start. Each getter throws ParameterError for a value of the wrong type.
/// An empty text, and "unset", which launch files pass on, count as not set.
class Parameters {
 public:
  /// Parameters in the namespace of `node`. Errors write `prefix` before the name: "~" for private ones.
  Parameters(const ros::NodeHandle& node, const std::string& prefix) : node_(node), prefix_(prefix) {}

  std::string text(const std::string& name, const std::string& default_value);
  bool flag(const std::string& name, bool default_value);
  std::optional<bool> flag(const std::string& name, std::optional<bool> default_value);
  double number(const std::string& name, double default_value, const Range& range);
  std::optional<double> number(const std::string& name, std::optional<double> default_value, const Range& range);

  /// The refusal of `value` for a parameter: "parameter ~name = value: must be ...".
  ParameterError refusal(const std::string& name, const std::string& value, const std::string& allowed) const;

  /// Throws if a parameter is set that no getter has asked for: it is probably misspelt.
  void refuse_others() const;

 private:
  bool get(const std::string& name, XmlRpc::XmlRpcValue& value);

  ros::NodeHandle node_;
  std::string prefix_;
  std::set<std::string> known_;
};

}  // namespace youbot_base_sim
