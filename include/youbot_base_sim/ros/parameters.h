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

/// A node's private parameters, read once at its start. Throws ParameterError.
class Parameters {
 public:
  explicit Parameters(const ros::NodeHandle& private_node) : node_(private_node) {}

  std::string text(const std::string& name, const std::string& otherwise);
  bool flag(const std::string& name, bool otherwise);
  /// Within [least, greatest], in `unit`.
  double number(const std::string& name, double otherwise, double least, double greatest, const char* unit);

  /// Refuses parameters that nobody has asked for: they are likely misspelt.
  void refuse_others() const;

 private:
  bool get(const std::string& name, XmlRpc::XmlRpcValue& value);

  ros::NodeHandle node_;
  std::set<std::string> known_;
};

/// The refusal of `value` for a parameter: "parameter ~name = value: must be ...".
ParameterError refusal(const std::string& name, const std::string& value, const std::string& allowed);

}  // namespace youbot_base_sim
