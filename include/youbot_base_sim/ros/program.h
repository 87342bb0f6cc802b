#pragma once

#include <ros/node_handle.h>

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/text/number.h"

namespace youbot_base_sim {

/// A wrong parameter: one line with its name, its value and what is allowed.
struct ParameterError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads the parameters of a node. An empty text, and "unset", which launch files pass on, count as not set.
class Parameters {
 public:
  /// Parameters in the namespace of `node`. Errors write `prefix` before the name: "~" for private ones.
  Parameters(const ros::NodeHandle& node, const std::string& prefix) : node_(node), prefix_(prefix) {}

  /// Sets `value` if the parameter is set. Returns whether it is. Throws ParameterError for one of the wrong type.
  bool read(const std::string& name, std::string& value);
  bool read(const std::string& name, bool& value);
  bool read(const std::string& name, double& value, const Range& range);
  /// A list with as many numbers as `values` has.
  bool read(const std::string& name, Eigen::Ref<Eigen::ArrayXd> values, const Range& range);
  bool read(const std::string& name, std::vector<std::string>& texts);
  template <class Value, class... Limits>
  bool read(const std::string& name, std::optional<Value>& value, const Limits&... limits) {
    Value set{};
    if (!read(name, set, limits...)) return false;
    value = set;
    return true;
  }

  /// Reads it in the nearest namespace upwards that has the parameter.
  bool search(const std::string& name, std::string& value) const;

  /// Throws unless `holds`: "parameter ~name = value: must be ...".
  void require(bool holds, const std::string& name, const std::string& value, const std::string& allowed) const;

  /// Throws if a parameter is set that has not been read: it is probably misspelt.
  void refuse_others() const;

 private:
  bool get(const std::string& name, XmlRpc::XmlRpcValue& value);

  ros::NodeHandle node_;
  std::string prefix_;
  std::set<std::string> known_;
};

/// The common part of all nodes' main functions: initializes ROS, refuses command line arguments that ROS does not
/// know, and runs `body`. SIGINT, SIGTERM and SIGHUP set `stop_requested` (offline_program.h) and shut ROS down, upon
/// which `body` has to return. Returns the exit status: 0; 2 for a refused argument or a ParameterError, 1 for any
/// other exception, both with a line in the log.
int run_program(int argc, char** argv, const char* name, const std::function<void()>& body);

}  // namespace youbot_base_sim
