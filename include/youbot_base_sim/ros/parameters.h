#pragma once

#include <ros/node_handle.h>

#include <set>
#include <stdexcept>
#include <string>

namespace youbot_base_sim {

/// What is wrong with a parameter, in one line: its name, its value and what is allowed.
class ParameterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Parameters of a node, read once at its start. Throws ParameterError.
class Parameters {
 public:
  /// Those in the namespace of `node`; errors call them by `prefix`, "~" for the private ones, and their name.
  Parameters(const ros::NodeHandle& node, const std::string& prefix) : node_(node), prefix_(prefix) {}

  std::string text(const std::string& name, const std::string& otherwise);
  bool flag(const std::string& name, bool otherwise);
  /// Within [least, greatest], in `unit`.
  double number(const std::string& name, double otherwise, double least, double greatest, const char* unit);

  /// The refusal of `value` for a parameter: "parameter ~name = value: must be ...".
  ParameterError refusal(const std::string& name, const std::string& value, const std::string& allowed) const;

  /// Refuses parameters that nobody has asked for: they are likely misspelt.
  void refuse_others() const;

 private:
  bool get(const std::string& name, XmlRpc::XmlRpcValue& value);

  ros::NodeHandle node_;
  std::string prefix_;
  std::set<std::string> known_;
};

}  // namespace youbot_base_sim
